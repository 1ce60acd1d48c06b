"""InflowWind: the wind of a deck."""

from __future__ import annotations

import math
from pathlib import Path

from meltemi.core.errors import InputError
from meltemi.exchange.openfast_writer.deck import DEGREES, OUTPUTS, DeckNotes, ExportModel, Texts, turn
from meltemi.exchange.openfast_writer.template import fill
from meltemi.wind.fields import SteadyWind


def inflow(deck: ExportModel, notes: DeckNotes, wind: SteadyWind | str | Path, direction: float) -> Texts:
    """Text of the InflowWind file: steady wind, or a wind file.

    Args:
      direction: [rad] angle by which the wind of a file is rotated.

    Raises:
      InputError: another kind of wind.
    """
    hub = deck.turbine.hub_height
    values: dict[str, object] = {"WindVziList": hub, "RefHt": hub, "RefHt_Uni": hub, "RefHt_Hawc": hub}
    if isinstance(wind, SteadyWind):
        values |= {
            "WindType": 1,
            "HWindSpeed": wind.speed / math.cos(wind.upflow),
            "RefHt": wind.reference_height or hub,
            "PLexp": wind.shear_exponent,
            "PropagationDir": turn(wind.direction),
            "VFlowAng": wind.upflow * DEGREES,
        }
        if wind.roughness or wind.veer:
            notes.lost("roughness or veer of the wind", "InflowWind's steady wind has a power law only")
    elif isinstance(wind, str | Path) and Path(wind).suffix.lower() == ".bts":
        values |= {"WindType": 3, "FileName_BTS": Path(wind).absolute().as_posix()}
        values["PropagationDir"] = turn(direction)
    else:
        raise InputError(f"write_openfast: wind {str(wind)[:60]!r}: expected a SteadyWind or a TurbSim file (.bts)")
    return {"InflowWind.dat": fill("InflowWind", deck.title, values, {"outputs": OUTPUTS["InflowWind"].split()})}
