"""The body of docs/development/bodies.md: acceleration and loads of its closed form, and what its program prints."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from programs import run, write_programs

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "development" / "bodies.md").read_text(encoding="utf-8")
CLOSED_FORM = """
from dataclasses import replace

import meltemi
import numpy as np
from meltemi.simulation.case import Case
from rocking import part_of

BLOCK = {"radius": 120.0, "height": 10.0, "mass": 8e6, "centre": -90.0, "inertia": 2e9, "friction": 0.0}
turbine = meltemi.load_turbine("nrel5mw").replace(
    foundation={"motions": ("pitch",), "mass": np.zeros((6, 6)), "stiffness": np.zeros((6, 6))},
    **{"nacelle.tilt": 0.0, "hub.precone": 0.0},
)
rigid = ("tower", "blades", "yaw", "generator", "drivetrain")
options = meltemi.ModelOptions(blade_nodes=30, tower_nodes=60, locked=rigid, wake="none", tower_drag=False)
model = meltemi.build(turbine, options).with_parameters(**{"aerodynamics.air_density": 0.0})
part = part_of(turbine.replace(extensions={"block": BLOCK}), options, model.rotor)
case = Case(replace(model, parts=(part,)), meltemi.SteadyWind(speed=0.0), meltemi.Stations())


def pieces(position, mass):
    z = np.linspace(0.0, position[-1], 4001)
    step = np.full(len(z), z[1])
    step[[0, -1]] *= 0.5
    return z, step * np.interp(z, position, mass)


# mass, x and z in axes of the block from the centre of its circle, inertia about y through it
tower, nacelle, hub = turbine.tower, turbine.nacelle, turbine.hub
z, mass = pieces(tower.position, tower.mass)
r, blade = pieces(turbine.blade.structure.position, turbine.blade.structure.mass)
base, top = BLOCK["height"], BLOCK["height"] + tower.length
tube = 0.5 * mass * (0.5 * np.interp(z, tower.position, tower.diameter)) ** 2
above = [
    *zip(mass, 0.0 * z, base + z, tube),
    (nacelle.mass, nacelle.mass_centre[0], top + nacelle.mass_centre[2], nacelle.nod_inertia),
    (hub.mass, hub.mass_centre - nacelle.overhang, top + nacelle.shaft_height, 0.0),
    (3.0 * blade.sum(), -nacelle.overhang, top + nacelle.shaft_height, 1.5 * (blade * (hub.radius + r) ** 2).sum()),
]


def sums(bodies):
    m, x, e, J = np.array(bodies).T
    return m.sum(), (m * x).sum(), (m * e).sum(), (m * (x * x + e * e) + J).sum()


g, R = model.parameter("structure.gravity"), BLOCK["radius"]
M, X, Z, J = sums([*above, (BLOCK["mass"], 0.0, BLOCK["centre"], BLOCK["inertia"])])
m, x, e, I = sums(above)
row = model.coordinates.index("base pitch")
for angle, rate in ((0.0, 0.0), (0.4, 0.3), (-0.9, 0.5)):
    case["q"][row], case["v"][row] = angle, rate
    case.evaluate(0.0)
    case.loads(0.0)
    c, s = np.cos(angle), np.sin(angle)
    a = (R * rate**2 + g) * (Z * s + X * c) / (M * R * R + 2.0 * R * (Z * c - X * s) + J)
    np.testing.assert_allclose(case["a"][row], a, rtol=1e-5)
    # what is above the tower's base: weight and inertia, in the axes of the base
    fx = -m * R * a - a * (e * c - x * s) + rate**2 * (x * c + e * s)
    fz = -m * g + a * (x * c + e * s) - rate**2 * (x * s - e * c)
    force = case.view("tower_station")["force"][:, 0]
    np.testing.assert_allclose(force, (fx * c - fz * s, 0.0, fx * s + fz * c), rtol=1e-5, atol=1e-5 * m * g)
    moment = (e - m * base) * (fx * c - fz * s) / m - x * (fx * s + fz * c) / m
    moment -= a * (I - (x * x + e * e) / m)
    np.testing.assert_allclose(case.view("tower_station")["moment"][1, 0], moment, rtol=1e-4)  # 60 pieces
"""


@pytest.fixture
def files(tmp_path: Path) -> Path:
    write_programs(PAGE, tmp_path)
    return tmp_path


def test_a_turbine_on_a_rocking_block_moves_as_its_closed_form(files: Path) -> None:
    """Accelerations and tower base loads of large angles, in plain Python: signs of motion, columns, known parts."""
    run(files, "-c", CLOSED_FORM, NUMBA_DISABLE_JIT="1")


def test_the_page_checks_an_instant(files: Path) -> None:
    (printed,) = re.findall(r'^```text title="at this instant"\n(.*?)^```', PAGE, re.MULTILINE | re.DOTALL)
    assert run(files, "instant.py", NUMBA_DISABLE_JIT="1") == printed


def test_a_number_of_the_block_that_is_missing_is_named(files: Path) -> None:
    code = "import tumbler; tumbler.part_of(tumbler.turbine.replace(extensions={'block': {'radius': 1.0}}), None, None)"
    with pytest.raises(AssertionError, match="extensions.block: missing height, mass, centre, inertia, friction"):
        run(files, "-c", code, NUMBA_DISABLE_JIT="1")


@pytest.mark.long
def test_the_program_prints_what_the_page_says(files: Path) -> None:
    (printed,) = re.findall(r'^```text title="printed"\n(.*?)^```', PAGE, re.MULTILINE | re.DOTALL)
    assert run(files, "swing.py") == printed
