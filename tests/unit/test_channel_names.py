"""Wherever a channel is asked for, our name and all of OpenFAST's do, upper or lower case alike."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import InputError, Model, Result
from meltemi.analysis import OperatingPoint
from meltemi.gradients.sensitivity import Sensitivity
from meltemi.postprocess.statistics import azimuth_bins
from meltemi.simulation.channels import standard
from meltemi.studies.difference import compare_results
from meltemi.studies.difference_plots import plot_differences
from meltemi.tuning.compare import Comparison

NAME = "root_moment_out_of_plane_1"
SPELLINGS = ("RootMyc1", "ROOTMYC1", "RootMOoP1", "rootmoop1", "Root_Moment_Out_Of_Plane_1")
TIME = np.arange(0.0, 100.0, 0.05)
RESULT = Result(
    TIME,
    np.stack([1.2 * TIME % (2.0 * np.pi), 8e6 + 1e6 * np.sin(1.2 * TIME), 1.2 + 0.01 * np.sin(TIME)], axis=1),
    tuple(standard()[name] for name in ("azimuth", NAME, "rotor_speed")),
)
SENSITIVITY: Any = SimpleNamespace(result=RESULT, slopes=np.ones((len(TIME), 3, 1)))


def label(figure: Any) -> str:
    return str(figure.axes[0].get_title(loc="left"))


USES: dict[str, Callable[[str], Any]] = {
    "series": lambda name: RESULT[name],
    "channel": lambda name: RESULT.channel(name),
    "contains": lambda name: name in RESULT,
    "revolution_means": lambda name: meltemi.loads.azimuthal_averages(RESULT, name),
    "azimuth_bins": lambda name: azimuth_bins(RESULT, name),
    "power_spectrum": lambda name: meltemi.loads.power_spectrum(RESULT, name, resolution=0.05).density,
    "ceiling": lambda name: meltemi.loads.ideal_removal(RESULT, name, bands=[(0.15, 0.25)]).std_left,
    "travel": lambda name: meltemi.loads.actuator_travel(RESULT, name),
    "equivalent_loads": lambda name: list(meltemi.equivalent_loads(RESULT, [name]).items()),
    "compare_results": lambda name: compare_results(RESULT, RESULT, [name]).channels,
    "plot": lambda name: label(meltemi.plot(RESULT, [name])),
    "plot_spectra": lambda name: label(meltemi.plots.plot_spectra({"a": [RESULT]}, name).figure),
    "plot_differences": lambda name: label(
        plot_differences(compare_results(RESULT, RESULT), [name], labels=("a", "b"))
    ),
    "sensitivity": lambda name: Sensitivity.series(SENSITIVITY, name)[0],
}


@pytest.mark.parametrize("use", USES)
def test_every_spelling_leads_to_the_same(use: str) -> None:
    expected = USES[use](NAME)
    assert expected is not False
    for name in SPELLINGS:
        np.testing.assert_array_equal(USES[use](name), expected)


@pytest.mark.parametrize("use", [use for use in USES if use != "contains"])
def test_no_spelling_but_these(use: str) -> None:
    with pytest.raises(InputError, match="no channel 'RootMyc'"):
        USES[use]("RootMyc")


def test_spectra_of_a_comparison() -> None:
    spectra = {name: meltemi.loads.power_spectrum(RESULT, NAME) for name in ("RootMyc1", "RootMxc1")}
    comparison: Any = SimpleNamespace(runs={"a": [SimpleNamespace(spectra=spectra)]})
    for name in (NAME, *SPELLINGS):
        np.testing.assert_array_equal(Comparison.spectrum(comparison, name, "a").density, spectra["RootMyc1"].density)
    with pytest.raises(InputError, match="spectrum of 'RotSpeed': there are those of RootMyc1 and RootMxc1"):
        Comparison.spectrum(comparison, "RotSpeed", "a")


@pytest.mark.slow
def test_operating_points_and_linear_models(model: Model) -> None:
    point: OperatingPoint = meltemi.operating_point(model, 12.0)
    assert len({point[name] for name in (NAME, *SPELLINGS)}) == 1
    linear = meltemi.analysis.linearise(
        model, point, inputs=["generator_torque"], outputs=["LSSTipVxa", "ttdspfa"], azimuth=0.0
    )
    assert linear.outputs == ("rotor_speed", "tower_top_fore_aft")
