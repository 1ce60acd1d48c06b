"""Signs of direction and yaw in a farm: nacelles face the wind, and loads of the table lie along it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi.cases.case import LoadCase, case_wind
from meltemi.farm.report import FORE_AFT, SIDE_SIDE, along_wind
from meltemi.farm.simulation import nacelle_yaw, yawed_models
from meltemi.loads.loadbase.campaign import make_campaign
from meltemi.loads.surrogate.campaign import SurrogateCampaign
from meltemi.simulation.channels import every_kind
from meltemi.simulation.result import Result


@pytest.mark.parametrize(
    ("yaw", "direction", "stands"), [(0, 60, -60), (20, 0, 20), (20, 60, -40), (-20, 250, 90), (0, 360, 0)]
)
def test_nacelles_face_the_wind(yaw: float, direction: float, stands: float) -> None:
    """The angle of a nacelle is counter-clockwise, the direction clockwise."""
    found = np.degrees(nacelle_yaw(np.radians(yaw), np.radians(direction)))
    assert found == pytest.approx(stands, abs=1e-9)


def test_turbines_that_stand_alike_share_a_model() -> None:
    model = meltemi.build(meltemi.load_turbine("pmsg20mw"))
    assert yawed_models([model, model], np.zeros(2), 0.0) == [model, model]
    one, two, three = yawed_models([model] * 3, np.array([0.0, 0.1, 0.0]), 0.5)
    assert one is three and one is not two
    assert (one.options.nacelle_yaw, two.options.nacelle_yaw) == pytest.approx((-0.5, -0.4))
    with pytest.raises(meltemi.InputError, match="options.nacelle_yaw: turbines of a farm face the wind"):
        yawed_models([one], np.zeros(1), 0.0)


def test_the_table_has_wind_and_tower_load_along_the_wind() -> None:
    """A wind of direction 90 deg blows towards -y, where it pushes the tower: to the right looking along x."""
    names = ("wind_x", "wind_y", FORE_AFT, SIDE_SIDE)
    channels = tuple(every_kind()[name] for name in names)
    result = Result(np.array([0.0]), np.array([[0.0, -9.0, 0.0, 5.0]]), channels)
    found = along_wind(result, np.radians(90.0))
    assert found.data[0] == pytest.approx([9.0, -9.0, 5.0, 5.0])
    assert along_wind(result, 0.0) is result


def test_a_case_turns_the_wind_of_its_file(tmp_path: Path) -> None:
    turbine = meltemi.load_turbine("nrel5mw")
    series = meltemi.WindSeries(time=[0.0, 10.0], speed=[9.0, 9.0], direction=[0.1, 0.2])
    box = meltemi.WindBox(np.full((8, 3, 3, 3), 9.0, np.float32), 1.0, 80.0, 80.0, 10.0, 9.0)
    for name, wind, expected in (("wind.wnd", series, [-0.2, -0.1]), ("wind.nc", box, -0.3)):
        meltemi.io.write_wind(wind, tmp_path / name)
        data: dict[str, Any] = {"kind": "file", "file": name, "direction": -0.3}
        case = LoadCase(turbine="nrel5mw", wind=data, duration=1.0)  # type: ignore[arg-type]
        found: Any = case_wind(case, turbine, tmp_path)
        assert found.direction == pytest.approx(expected, abs=1e-6)


def test_yaw_errors_of_load_cases_are_directions_of_the_wind() -> None:
    with pytest.raises(meltemi.InputError, match="yaw errors are directions of the wind"):
        SurrogateCampaign(turbine="nrel5mw", options={"nacelle_yaw": 0.1})
    with pytest.raises(meltemi.InputError, match="yaw errors of load cases are directions of the wind"):
        make_campaign("nrel5mw", rated_wind=11.4, options={"nacelle_yaw": 0.1})
