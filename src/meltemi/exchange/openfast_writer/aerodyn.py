"""AeroDyn: options, sections of the blade, tower, polars with their constants of dynamic stall."""

from __future__ import annotations

import re

import numpy as np

from meltemi.aero.stall_tables import zero_lift_angle
from meltemi.exchange.openfast.airfoils import has_lift
from meltemi.exchange.openfast_writer.deck import DEGREES, OUTPUTS, DeckNotes, ExportModel, Texts
from meltemi.exchange.openfast_writer.template import fill, table
from meltemi.simulation.options import BEDDOES, StallConstants
from meltemi.turbine.definition import Airfoil, Blade

ATTACHED = 0.7
"""Attached fraction of the flow at OpenFAST's alpha1 and alpha2."""
LINEAR = (-0.06, 0.09)
"""[rad] range about zero lift in which the normal force is taken as linear."""
STALL_RADII = (0.25, 0.95)
"""Range of r/R in which OpenFAST computes dynamic stall: its model fails at cylindrical roots and at tips."""
NEAR = 1e-7
"""[rad] difference below which OpenFAST treats two angles of a polar as equal, and stops."""


def aerodyn(deck: ExportModel, notes: DeckNotes) -> Texts:
    """Texts of the AeroDyn file, its blade file, and a file for each airfoil."""
    t, o = deck.turbine, deck.options
    names = list(dict.fromkeys(t.blade.aerodynamics.airfoil))
    foils = {name: t.airfoils[name] for name in names}
    files = {name: f"Airfoils/{re.sub(r'[^A-Za-z0-9_.+-]+', '_', name)}.dat" for name in names}
    if len(set(files.values())) < len(files):
        files = {name: f"Airfoils/{i + 1:02d}.dat" for i, name in enumerate(names)}
    if unused := [name for name in t.airfoils if name not in files]:
        notes.lost(f"airfoils {', '.join(unused)}", "no station of the blade uses them")
    if t.blade.aerodynamics.cant is None and t.blade.structure.axis_x is not None:
        notes.changed("cant of the sections", "BlCrvAng is the slope of the beam's axis")
    if o.tower_influence == "lower_half":
        notes.changed("tower_influence lower_half", "TwrPotent 1: everywhere below the tower top")
    steady = o.wake == "none" or o.inflow == "quasi_steady"
    values: dict[str, object] = {
        "Wake_Mod": {"none": 0, "hybrid": 3, "free": 3}.get(o.wake, 1),
        "OLAFInputFileName": "OLAF.dat" if o.wake in ("hybrid", "free") else "unused",
        "TwrPotent": 0 if o.tower_influence == "none" else 1,
        "TwrShadow": {"powles": 1, "eames": 2}.get(o.tower_influence, 0),
        "TwrAero": o.tower_drag,
        "AirDens": deck.environment.density,
        "Skew_Mod": 1 if o.skew == "glauert" else 0,
        "TipLoss": o.tip_loss,
        "HubLoss": o.hub_loss,
        "AIDrag": o.axial_drag,
        "TIDrag": o.tangential_drag,
        "DBEMT_Mod": 0 if steady else 1 if o.inflow == "constant" else 2,
        "tau1_const": o.inflow_time,
        "UA_Mod": 4 if o.stall == "hansen" else 0,
        **dict(zip(("UAStartRad", "UAEndRad"), STALL_RADII if o.stall == "hansen" else (0, 1), strict=True)),
        "NumAFfiles": len(names),
        "ADBlFile": "AeroDyn_blade.dat",
        "NumTwrNds": len(t.tower.position),
    }
    constants = ([value] * len(t.tower.position) for value in (t.tower.drag_coefficient, 0.1, 0.0, 0.0, 0.0))
    height = t.tower.base_height + t.tower.position
    names_of_tower = "TwrElev TwrDiam TwrCd TwrTI TwrCb TwrCp TwrCa"
    tower = table(names_of_tower, "m m - - - - -", height, t.tower.diameter, *constants)
    listed = [f'"{file}"' for file in files.values()]
    listed[0] += "    AFNames - airfoil files"
    tables = {"airfoils": listed, "tower": tower, "outputs": OUTPUTS["AeroDyn"].split()}
    texts = {
        "AeroDyn.dat": fill("AeroDyn", deck.title, values, tables),
        "AeroDyn_blade.dat": _blade(t.blade, names, deck.title),
    }
    if o.stall == "hansen":
        notes.changed("dynamic stall", "from {} to {} of the radius; static polars beyond".format(*STALL_RADII))
        static = [n for n, a in foils.items() if not a.dynamic_stall and has_lift(a.angle_of_attack, a.lift)]
        if static:
            what = f"static polars of {', '.join(static)}"
            notes.changed(what, "OpenFAST has dynamic stall wherever there is lift")
    whole = {name: _closed(foil) for name, foil in foils.items()}
    if changed := [name for name, foil in foils.items() if len(whole[name].lift) < len(foil.lift)]:
        why = "angles that are the same but for rounding are written once"
        notes.changed(f"polars of {', '.join(changed)}", why)
    if changed := [name for name, foil in foils.items() if abs(foil.lift[-1] - foil.lift[0]) > NEAR]:
        notes.changed(f"polars of {', '.join(changed)}", "the mean of both ends is used at -180 and 180 degrees")
    for name, file in files.items():
        texts[file] = _airfoil(name, whole[name], o.stall_constants)
    return texts


def _blade(blade: Blade, names: list[str], title: str) -> str:
    a, s = blade.aerodynamics, blade.structure
    n = len(a.position)
    zero = np.zeros(n)
    x, y = (zero if value is None else value for value in (a.centre_x, a.centre_y))
    cant = zero if a.cant is None else a.cant
    if a.cant is None and s.axis_x is not None:  # sections are normal to the axis of the beam
        cant = np.arctan(np.interp(a.position, s.position, np.gradient(s.axis_x, s.position)))
    ids = [str(names.index(name) + 1) for name in a.airfoil]
    numbers = (a.position, x, y, cant * DEGREES, a.twist * DEGREES, a.chord)
    names_of_columns = (
        "BlSpn BlCrvAC BlSwpAC BlCrvAng BlTwist BlChord BlAFID t_c BlCb BlCenBn BlCenBt BlCpn BlCpt BlCan BlCat BlCam"
    )
    units = "m m m deg deg m - - - m m - - - - -"
    stations = table(names_of_columns, units, *numbers, ids, *([0.0] * n for _ in range(9)))
    return fill("AeroDyn blade", title, {"NumBlNds": n}, {"stations": stations})


def _closed(airfoil: Airfoil) -> Airfoil:
    """A polar with angles that increase by more than ``NEAR``, from -pi to pi, and equal coefficients at both ends."""
    alpha = airfoil.angle_of_attack.copy()
    alpha[[0, -1]] = -np.pi, np.pi
    keep = [0]
    for i in range(1, len(alpha) - 1):
        if alpha[keep[-1]] + NEAR < alpha[i] < np.pi - NEAR:
            keep.append(i)
    keep.append(len(alpha) - 1)
    values = {"angle_of_attack": alpha[keep]}
    for name in ("lift", "drag", "moment"):
        values[name] = getattr(airfoil, name)[keep]
        values[name][[0, -1]] = 0.5 * (values[name][0] + values[name][-1])
    return airfoil.replace(**{name: value.tolist() for name, value in values.items()})


def _airfoil(name: str, airfoil: Airfoil, constants: StallConstants) -> str:
    """Text of a polar; constants of dynamic stall that the turbine does not have are left to OpenFAST."""
    alpha = airfoil.angle_of_attack
    stated = airfoil.dynamic_stall and (airfoil.zero_lift_angle is not None or constants != BEDDOES)
    values: dict[str, object] = {"NumAlf": len(alpha), "InclUAdata": stated}
    if stated:
        values |= _stall(airfoil, constants)
    names, units, *rows = table(
        "Alpha Cl Cd Cm", "deg - - -", alpha * DEGREES, airfoil.lift, airfoil.drag, airfoil.moment
    )
    text = fill("airfoil", name, values, {"polar": [f"!  {names}", f"!  {units}", *rows]})
    if not stated:
        lines = text.splitlines(keepends=True)
        first = next(i for i, line in enumerate(lines) if " alpha0 " in line)
        last = next(i for i, line in enumerate(lines) if " NumAlf " in line)
        text = "".join(lines[:first] + lines[last:])
    return text


def _stall(airfoil: Airfoil, constants: StallConstants) -> dict[str, object]:
    """OpenFAST's constants of dynamic stall, from the airfoil or from its normal force.

    Its slope is that of a straight line near zero lift; alpha1 and alpha2 are where Kirchhoff's flow
    C_n = C_n,alpha (1 + sqrt f)^2 / 4 (alpha - alpha0) has the attachment f = 0.7 on either side.
    """
    alpha, lift, drag = airfoil.angle_of_attack, airfoil.lift, airfoil.drag
    zero = zero_lift_angle(alpha, lift) if airfoil.zero_lift_angle is None else airfoil.zero_lift_angle
    floor = float(np.interp(zero, alpha, drag)) if airfoil.zero_lift_drag is None else airfoil.zero_lift_drag
    normal = lift * np.cos(alpha) + (drag - floor) * np.sin(alpha)
    fine = zero + np.linspace(*LINEAR, 41)
    slope = float(np.polyfit(fine, np.interp(fine, alpha, normal), 1)[0])
    fine = zero + np.linspace(-0.6, 0.6, 2401)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.interp(fine, alpha, normal) / (slope * (fine - zero))
    separated = (2.0 * np.sqrt(np.clip(ratio, 0.25, 1.0)) - 1.0) ** 2 < ATTACHED
    upper = fine[separated & (fine > zero + LINEAR[1])]
    lower = fine[separated & (fine < zero + LINEAR[0])]
    first = float(upper[0]) if len(upper) else zero + 0.6
    last = float(lower[-1]) if len(lower) else zero - 0.6
    return {
        "alpha0": zero * DEGREES,
        "alpha1": first * DEGREES,
        "alpha2": last * DEGREES,
        "C_nalpha": slope,
        "T_f0": constants.separation_lag,
        "T_p": constants.pressure_lag,
        "b1": constants.b1,
        "b2": constants.b2,
        "A1": constants.a1,
        "A2": constants.a2,
        "Cn1": float(np.interp(first, alpha, normal)),
        "Cn2": float(np.interp(last, alpha, normal)),
        "Cd0": floor,
        "Cm0": float(np.interp(zero, alpha, airfoil.moment)),
    }
