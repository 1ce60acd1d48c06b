"""HAWC2's models: what HAWCStab2's lift changes, and the comparisons that a folder has."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from meltemi.core.errors import InputError
from meltemi.turbine.library import DATA, load_turbine
from meltemi.verification import hawc2
from meltemi.verification.table import reference_table
from meltemi.verification.verification import verification


@pytest.mark.slow
def test_the_direction_of_its_lift_explains_hawcstab2s_power() -> None:
    """IEA 10 MW, 5 m/s: lift normal to the flow at three quarters of the chord takes more than half of +3.9 %."""
    (row,) = reference_table("hawc2_steady", turbine="iea10", wind="5")
    model = hawc2.rotor_of(load_turbine("iea10mw"))
    point = hawc2.point_of_row(model, row)
    power, reference = hawc2._loads(point)["power"], 1e3 * float(row["power"])
    tilted = power + hawc2._power_of_tilt(model, point)
    assert 100.0 * (power / reference - 1.0) == pytest.approx(3.92, abs=0.1)
    assert 100.0 * (tilted / reference - 1.0) == pytest.approx(1.66, abs=0.15)


def test_elements_of_constant_sections_have_the_mean_of_each_element() -> None:
    """Between two nodes of the model the stiffness is one matrix, and its integral that of the imported blade."""
    turbine = load_turbine("iea10mw")
    nodes = hawc2.blade_nodes(hawc2.blade_of(DATA / "iea10mw" / "iea10mw.htc"))
    plain, made = turbine.blade.structure, hawc2.with_elements(turbine, nodes).blade.structure
    assert plain.mass_matrix is not None and made.mass_matrix is not None
    assert len(made.position) == 2 * (len(nodes) - 1)
    assert made.mass_matrix[0::2] == pytest.approx(made.mass_matrix[1::2], rel=1e-12)
    mass = [np.trapezoid(s.mass_matrix[:, 0, 0], s.position) for s in (plain, made)]
    assert mass[1] == pytest.approx(mass[0], rel=1e-5)
    assert made.twist[-1] == pytest.approx(plain.twist[-1])


def test_it_is_a_comparison_of_its_own(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--hawc2 excludes the other options"):
        verification(models=tmp_path, quick=True)


def test_a_folder_gives_the_comparisons_of_its_models(tmp_path: Path) -> None:
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / hawc2.DTU10.main).touch()
    assert len(hawc2.studies(tmp_path)) == 4  # IEA 10 MW of the library, flexible, stiff, frequencies
