"""The main file of a deck, and its time step."""

from __future__ import annotations

from collections.abc import Mapping

from meltemi.exchange.openfast_writer.deck import ExportModel, Texts
from meltemi.exchange.openfast_writer.template import fill
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.rotors import build
from meltemi.simulation.vibrations import highest_frequency

STEPS = (0.01, 0.00625, 0.005, 0.0025, 0.002, 0.00125, 0.001, 0.0005, 0.00025, 0.0002, 0.0001)
"""[s] time steps with few digits that divide ``OUTPUT_STEP``, as OpenFAST requires."""
FRAME_STEP = 0.025
"""[s] time step with a frame, whose Jacobian is large."""
OUTPUT_STEP = 0.05
"""[s] interval between outputs."""
LOOSE, TIGHT = 1, 3
"""Coupling of OpenFAST's modules: explicit; implicit, which BeamDyn and SubDyn need at any usable time step."""
FINENESS = 0.45
"""Time step times the highest frequency of ElastoDyn's degrees of freedom, at most."""


def time_step_of(deck: ExportModel) -> float:
    """Time step [s] that resolves the requested degrees of freedom that ElastoDyn has."""
    o = deck.options
    wanted = deck.modes | {"fore_aft": o.fore_aft_modes, "side_side": o.side_side_modes}
    most = {"flap": 2, "edge": 1, "torsion": 0, "fore_aft": 2, "side_side": 2}
    modes = {f"{name}_modes": min(wanted[name], n) for name, n in most.items()}
    has = ModelOptions(locked=o.locked).replace(**modes)
    frequency = highest_frequency(build(deck.turbine, has, deck.environment))
    return next((step for step in STEPS if step * frequency <= FINENESS), STEPS[-1])


def main_file(
    deck: ExportModel, hydro_files: Mapping[str, str], duration: float, step: float, beamdyn: bool, level: float
) -> Texts:
    """Text of the main file (.fst).

    Args:
      hydro_files: names of the hydrodynamic files.
      duration, step: [s] simulated time and time step.
      level: [m] still-water level.
    """
    torsion, sea = deck.turbine.blade.structure.twists, deck.below
    files = {"Hydro": "HydroDyn", "Sub": "SubDyn", "Mooring": "MoorDyn", "SeaSt": "SeaState"}
    values: dict[str, object] = {
        "TMax": duration,
        "DT": step,
        "ModCoupling": TIGHT if beamdyn or deck.stands else LOOSE,
        # water moves with members: more correction iterations in a step, which converge to 1e-4 with forces in single
        # precision
        "MaxConvIter": 40 if deck.turbine.frame is not None else 30 if deck.at_sea else 6,
        "ConvTol": 1e-3 if deck.at_sea else 1e-4,
        "DT_UJac": 1.0 if deck.turbine.platform is not None else 99999.0,  # a tilted hull exchanges differently
        "DT_Out": step * max(1, round(OUTPUT_STEP / step)),
        "CompElast": 2 if beamdyn else 1,
        "Gravity": deck.environment.gravity,
        "AirDens": deck.environment.density,
        "EDFile": "ElastoDyn.dat",
        "BDBldFile": "BeamDyn.dat" if torsion else "unused",
        "InflowFile": "InflowWind.dat",
        "AeroFile": "AeroDyn.dat",
        "ServoFile": "ServoDyn.dat",
    }
    if sea is not None:
        values |= {"WtrDens": sea.water_density, "WtrDpth": sea.depth, "MSL2SWL": level}
        present = {name: f"{module}.dat" for name, module in files.items() if f"{module}.dat" in hydro_files}
        values |= {f"Comp{name}": 3 if name == "Mooring" else 1 for name in present}
        values |= {f"{name}File": file for name, file in present.items()}
    return {f"{deck.name}.fst": fill("main", deck.title, values, {})}
