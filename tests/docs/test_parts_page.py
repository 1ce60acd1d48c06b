"""The parts of docs/development/parts.md: they run, and the programs print what the page says."""

from __future__ import annotations

import pickle
import re
from pathlib import Path

import numpy as np
import pytest
from programs import run, write_programs

from meltemi.compiler import Array1, KernelRecord, hook, joined, kernel, records

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "development" / "parts.md").read_text(encoding="utf-8")
LINEAR = """
from heave import added, gain, mass, model, rate, stiffness, water
from meltemi.analysis import linearise, parked_point
import numpy as np

point = parked_point(model, 0.0, rotor_speed=0.0)
found = linearise(model, point, (), (), azimuth=0.0).eigenvalues
exact = np.roots([mass + added, (mass + added) * rate, stiffness + gain, stiffness * rate])
for each in exact:
    assert np.abs(found - each).min() < 1e-3 * abs(each), (found, exact)
"""


@pytest.fixture
def files(tmp_path: Path) -> Path:
    write_programs(PAGE, tmp_path)
    return tmp_path


@pytest.mark.slow
@pytest.mark.parametrize("name", [pytest.param("heave.py", marks=pytest.mark.long), "row.py"])
def test_the_programs_print_what_the_page_says(files: Path, name: str) -> None:
    """Heave of a moving base with buoyancy, added mass, radiation and a sea; a turbine in the wake of another one."""
    (printed,) = re.findall(
        rf'^```python title="{name}"\n.*?^```\n\n```text title="printed"\n(.*?)^```', PAGE, re.MULTILINE | re.DOTALL
    )
    assert run(files, name, NUMBA_DISABLE_JIT="1") == printed
    if name == "heave.py":
        found, exact = (float(x) for x in re.findall(r"\d\.\d+", printed))
        assert found == pytest.approx(exact, rel=0.01)


@pytest.mark.long
def test_a_part_has_states_in_linear_models(files: Path) -> None:
    """Compiled, in derivatives: the eigenvalues are the roots of the base's equation."""
    run(files, "-c", LINEAR)


class Base(KernelRecord):
    x: Array1


class One(Base):
    """A part that adds one."""


class Two(Base):
    """A part that multiplies by ten."""


@hook
def act(m: Base) -> None:
    """Where parts act."""


@act.variant
@kernel
def _(m: One) -> None:
    m.x[0] += 1.0


@act.variant
@kernel
def _(m: Two) -> None:
    m.x[0] *= 10.0


@kernel
def twice(m: Base) -> None:
    act(m)
    act(m)


@pytest.mark.parametrize(("parts", "once", "both"), [((), 3.0, 3.0), ((Two,), 30.0, 300.0), ((One, Two), 40.0, 410.0)])
def test_a_hook_calls_the_variants_of_all_classes_that_a_record_joins(
    parts: tuple[type[KernelRecord], ...], once: float, both: float
) -> None:
    """From the host and in kernels, in the order of the parts."""
    kind = joined(*parts, Base)
    record = kind("floats", {"x": np.array([3.0])})
    act(record)
    assert record.x[0] == once
    record.x[0] = 3.0
    twice(record)
    assert record.x[0] == both


def test_a_joined_class_is_found_again_by_its_name() -> None:
    """As by machine code from the cache."""
    assert joined(Base) is Base
    assert joined(One, Base) is One
    made = joined(One, Two, Base)
    assert issubclass(made, One) and issubclass(made, Two)
    assert pickle.loads(pickle.dumps(made)) is made
    assert getattr(records, made.__name__) is made
