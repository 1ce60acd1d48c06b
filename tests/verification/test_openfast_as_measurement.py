"""Series of OpenFAST in the place of measured ones: what the simulation of the same deck must find inside.

Reference: series of OpenFAST v5.0.0, NREL 5 MW in turbulence of 20 m/s (shared/reference/openfast).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import meltemi
from meltemi.validation.channel_map import ChannelMap
from meltemi.validation.comparison import Comparison
from meltemi.validation.measurements import measurements_of
from meltemi.validation.reduction import STATISTICS
from meltemi.validation.settings import Validation
from meltemi.validation.simulations import Simulator, simulate_records
from meltemi.verification.openfast_deck import deck_options, deck_turbine

COLUMNS = {
    "generator_power": ("GenPwr", "kW"),
    "rotor_speed": ("RotSpeed", "rpm"),
    "root_moment_flap_1": ("RootMyb1", "kN m"),
    "tower_base_moment_fore_aft": ("TwrBsMyt", "kN m"),
    "azimuth": ("Azimuth", "deg"),
}
WIND = {"u": "Wind1VelX", "v": "Wind1VelY", "w": "Wind1VelZ"}


@pytest.mark.long
def test_openfast_lies_inside_what_seeds_resolve(reference: Path) -> None:
    """The hub's wind of OpenFAST is all that is known: loads agree within the spread of the fields through it."""
    sonic = {"unit": "m/s", "kind": "sonic", "height": 90.0}
    channels = {name: sonic | {"column": column, "component": name} for name, column in WIND.items()}
    channels |= {name: {"column": column, "unit": unit} for name, (column, unit) in COLUMNS.items()}
    loggers = {"of": {"time": {"column": "Time", "form": "posix"}, "channels": channels}}
    table: dict[str, list[np.ndarray]] = {}
    for k, name in enumerate(("B_turb_vkm20_s1", "B_turb_vkm20_s2")):
        with np.load(reference / f"openfast/series/{name}.npz") as file:
            series = dict(zip(file["channels"].tolist(), file["data"].T.astype(float), strict=True))
        part = (series["Time"] >= 100.0 - 1e-6) & (series["Time"] < 700.0 - 1e-6)
        for key, x in series.items():
            table.setdefault(key, []).append(x[part] + (6e8 + 1100.0 * k - 100.0 if key == "Time" else 0.0))
    settings = Validation(
        case="", channels=ChannelMap(wind="u", loggers=loggers), seeds=6,
        conditions={"*": {"shear_exponent": 0.2}},
        turbulence={"spectrum": "vonkarman", "edition": 2, "coherent": "u", "points": 15, "dt": 0.1},
    )  # fmt: skip
    records = measurements_of({"of": {key: np.concatenate(x) for key, x in table.items()}}, settings.channels)
    turbine = deck_turbine(meltemi.load_turbine("nrel5mw"))
    case = meltemi.io.LoadCase(
        turbine="nrel5mw", wind={"kind": "steady", "speed": 20.0}, duration=60.0, options=deck_options(turbine, "B")
    )
    simulator = Simulator(settings, case, Path(), turbine)
    names = [name for name in COLUMNS if name != "azimuth"]
    compared, failed = simulate_records(simulator, records, names)
    assert not failed
    comparison = Comparison(tuple(compared), tuple(names))
    judged = [a for a in comparison.agreements() if a.statistic in (*STATISTICS[:2], *STATISTICS[4:6])]
    for a in judged:
        print(a.channel, a.statistic, f"{100.0 * a.bias:+.1f} {100.0 * a.resolvable:.1f} {a.verdict}")
    assert np.mean([a.outside == 0.0 for a in judged]) >= 0.85
