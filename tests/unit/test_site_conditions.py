"""Site conditions in the JSON form of IEC 61400-15-1: read, checked, and used by a plan."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import pytest

from meltemi.cases.case import case_wind
from meltemi.core.errors import InputError
from meltemi.loads.effective import effective_intensity, wake_turbulence
from meltemi.loads.loadbase.campaign import make_campaign
from meltemi.loads.loadbase.plan import plan
from meltemi.loads.loadbase.site import VERSION, read_site
from meltemi.turbine.library import load_turbine

MEAN, DEVIATION, EXTREME = [0.0, 20.0, 16.0, 14.0, 13.0], [0.0, 4.0, 3.0, 2.0, 2.0], [0.0, 40.0, 30.0, 26.0, 24.0]
"""[%] in bins of 5 m/s, the first one empty."""


def form(**changes: Any) -> dict[str, Any]:
    """A form with two turbines, in the keys of the digital exchange format."""
    layout = {
        "Annual Average Wind Speed": 8.0,
        "Weibull Scale Parameter": 9.0,
        "Weibull Shape Parameter": 2.1,
        "V50": 40.0,
        "Air Density": 1.1,
        "TI15": 0.14,
    }
    both: Callable[[Any], dict[str, Any]] = lambda value: {"T1": value, "T2": value}  # noqa: E731
    return {
        "DEF version": "1.1",
        "Project Information": {"Project name": "Hill"},
        "Meta Data": {"Wind speed bin width": 5.0},
        "Turbine Layout Summary": both(layout),
        "Ambient Mean TI": both({"Ambient mean TI all directions": MEAN}),
        "SD TI": both({"SD TI all directions": DEVIATION}),
        "Extreme Ambient TI": both({"Extreme ambient TI": EXTREME}),
        "CcT": both({"CcT": 1.1}),
        "Shear": both({"Shear all directions": 0.25}),
        "Inflow Angle": both({"Inflow angle max": 5.0}),
    } | changes


@pytest.fixture
def written(tmp_path: Path) -> Callable[..., Path]:
    def write(**changes: Any) -> Path:
        path = tmp_path / "site.json"
        path.write_text(json.dumps(form(**changes)), encoding="utf-8")
        return path

    return write


def test_a_form_is_read(written: Callable[..., Path]) -> None:
    site = read_site(written(), "T2")
    assert site.name == "Hill, turbine T2"
    assert (site.mean_speed, site.weibull_scale, site.weibull_shape, site.v50) == (8.0, 9.0, 2.1, 40.0)
    assert (site.shear_exponent, site.air_density) == (0.25, 1.1)
    assert site.inclination == pytest.approx(math.radians(5.0))
    # C_cT (mean + 1.28 standard deviations), linear in between, constant below the data
    assert site.intensity_at(10.0) == pytest.approx(1.1 * (0.16 + 1.28 * 0.03), abs=1e-6)
    assert site.intensity_at(12.5) == pytest.approx(0.5 * 1.1 * (0.30 + 1.28 * 0.05), abs=1e-6)
    assert site.intensity_at(1.0) == site.intensity_at(5.0)
    assert site.intensity_at(15.0, extreme=True) == 0.26


def test_a_plan_of_a_site_has_its_winds(written: Callable[..., Path]) -> None:
    site = read_site(written(), "T1")
    made = make_campaign(
        "nrel5mw", site.wind_class(4), 4, rated_wind=11.4, site=site, inclination=site.inclination, quick=True
    )
    found, turbine = plan(made), load_turbine("nrel5mw")
    names = {"1.1": "dlc1.1-11.4-s01", "1.3": "dlc1.3-11.4-y0-s01", "3.1": "dlc3.1-11.4", "6.1": "dlc6.1-40-y-8-s01"}
    winds: dict[str, Any] = {row: case_wind(found.case(n).case(), turbine, Path()) for row, n in names.items()}
    assert winds["1.1"].intensity == pytest.approx(site.intensity_at(11.4), rel=1e-12)
    assert winds["1.1"].shear_exponent == 0.25
    assert winds["1.3"].intensity == site.intensity_at(11.4, extreme=True)
    assert winds["3.1"].shear_exponent == 0.25 and winds["3.1"].upflow == site.inclination
    assert winds["6.1"].speed == 40.0 and winds["6.1"].shear_exponent == 0.11


@pytest.mark.parametrize("edition", [3, 4])
def test_wakes_of_neighbours_raise_normal_turbulence(written: Callable[..., Path], edition: Literal[3, 4]) -> None:
    """Fatigue loads have the effective intensity of their slope, ultimate ones the nearest wake (K-16, K-17)."""
    alone = read_site(written(), "T1")
    site = alone.replace(neighbours=(5.0, 7.0, 12.0), slope=4.0)
    made = make_campaign("nrel5mw", site.wind_class(edition), edition, rated_wind=11.4, site=site, quick=True)
    found, turbine, ambient = plan(made), load_turbine("nrel5mw"), alone.intensity_at(11.4)
    expected = {
        "1.1": wake_turbulence(11.4, 11.4 * ambient, 5.0, 7.0 / 11.4, edition=edition) / 11.4,
        "1.2": effective_intensity(11.4, ambient, (5.0, 7.0), slope=4.0, thrust=7.0 / 11.4, edition=edition),
        "1.3": alone.intensity_at(11.4, extreme=True),
    }
    for dlc, intensity in expected.items():
        case = next(c for c in found.cases if c.dlc == dlc and c.variant.speed == 11.4)
        wind: Any = case_wind(case.case(), turbine, Path())
        assert wind.intensity == pytest.approx(intensity, abs=1e-6), dlc
    assert ambient < expected["1.2"] < expected["1.1"]
    assert alone.replace(neighbours=(10.0,)).waked_at(11.4, edition, fatigue=True) == ambient
    with pytest.raises(InputError, match="distances of 2 rotor diameters"):
        alone.replace(neighbours=(1.0,))
    assert found.case("dlc1.1-11.4-s01").case().environment.air_density == 1.1
    shares = sum(c.weight.share for c in found.cases if c.weight)
    assert shares == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize(
    ("changes", "turbine", "words"),
    [
        ({}, None, "it has 2 turbines; choose one of them with its ID: T1, T2"),
        ({}, "T3", "no 'T3'; did you mean 'T"),
        ({"DEF version": "2.0"}, "T1", "expected '1.1'"),
        ({"Shear": {}}, "T1", "Shear.T1.Shear all directions: missing"),
        ({"CcT": {"T1": {"CcT": "high"}}}, "T1", "CcT.T1.CcT: expected a number, found 'high'"),
        ({"Ambient Mean TI": {"T1": {"Ambient mean TI all directions": [0, 0.2, 0.16, 0.14, 0.13]}}}, "T1", "per cent"),
        ({"Ambient Mean TI": {"T1": {"Ambient mean TI all directions": [0, 20, 16, 14]}}}, "T1", "different lengths"),
        ({"SD TI": {"T1": {"SD TI all directions": "none"}}}, "T1", "expected numbers [%]"),
    ],
)
def test_what_is_wrong_is_told(written: Callable[..., Path], changes: Any, turbine: str | None, words: str) -> None:
    with pytest.raises(InputError) as error:
        read_site(written(**changes), turbine)
    assert words in str(error.value)


def test_other_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "site.json"
    for text, words in (
        ("{", "not valid JSON"),
        ("[]", "no 'Turbine Layout Summary'"),
        ("{}", "input conditions form"),
        (json.dumps({"DEF version": VERSION, "Turbine Layout Summary": [2.0, 3.0]}), "expected turbines by their ID"),
    ):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=words):
            read_site(path)
