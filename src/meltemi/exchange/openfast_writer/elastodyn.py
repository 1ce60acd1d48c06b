"""ElastoDyn: turbine, blades and tower with two modes per direction, and the base of an offshore turbine."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from meltemi.exchange.openfast_writer.deck import DEGREES, OUTPUTS, RPM, DeckNotes, ExportModel, Texts, turn
from meltemi.exchange.openfast_writer.sections import classical, damping_ratios
from meltemi.exchange.openfast_writer.shapes import Shape, blade_shapes, tower_shapes
from meltemi.exchange.openfast_writer.template import fill, table
from meltemi.simulation.bladed.build import head_mass

AT_SEA = "PtfmSurge PtfmSway PtfmHeave PtfmRoll PtfmPitch PtfmYaw".split()
"""Output channels of ElastoDyn at sea."""


def elastodyn(
    deck: ExportModel, notes: DeckNotes, rotor_speed: float, pitch: float, azimuth: float, *, beamdyn: bool
) -> Texts:
    """Texts of the ElastoDyn file and its blade and tower files.

    Args:
      rotor_speed, pitch, azimuth: [rad/s], [rad], [rad] initial values.
      beamdyn: BeamDyn models the blades, so that no note on lost features is needed here.
    """
    t, o = deck.turbine, deck.options
    n, h, d = t.nacelle, t.hub, t.drivetrain
    free = {name: name not in o.locked for name in ("tower", "yaw", "generator", "drivetrain", "blades")}
    values: dict[str, object] = {
        "FlapDOF1": deck.modes["flap"] > 0 and free["blades"] and "flap" not in o.locked,
        "FlapDOF2": deck.modes["flap"] > 1 and free["blades"] and "flap" not in o.locked,
        "EdgeDOF": deck.modes["edge"] > 0 and free["blades"] and "edge" not in o.locked,
        "DrTrDOF": free["drivetrain"],
        "GenDOF": free["generator"],
        "YawDOF": free["yaw"],
        "TwFADOF1": o.fore_aft_modes > 0 and free["tower"],
        "TwFADOF2": o.fore_aft_modes > 1 and free["tower"],
        "TwSSDOF1": o.side_side_modes > 0 and free["tower"],
        "TwSSDOF2": o.side_side_modes > 1 and free["tower"],
        "BlPitch": pitch * DEGREES,
        "Azimuth": azimuth * DEGREES % 360.0,
        "RotSpeed": rotor_speed * RPM,
        "NacYaw": turn(o.nacelle_yaw),
        "NumBl": t.n_blades,
        "TipRad": t.rotor_radius,
        "HubRad": h.radius,
        "PreCone": -h.precone * DEGREES,
        "HubCM": h.mass_centre,
        "OverHang": -n.overhang,
        "ShftTilt": -n.tilt * DEGREES,
        **dict(zip(("NacCMxn", "NacCMyn", "NacCMzn"), n.mass_centre, strict=True)),
        "Twr2Shft": n.shaft_height,
        "TowerHt": t.tower.base_height + t.tower.length,
        "TowerBsHt": t.tower.base_height,
        "HubMass": h.mass,
        "YawBrMass": t.tower.top_mass,
        "HubIner": h.inertia,
        "GenIner": d.generator_inertia,
        "NacMass": n.mass,
        "NacYIner": n.yaw_inertia,
        "BldFile": "ElastoDyn_blade.dat",
        "GBoxEff": 100.0 * d.gearbox_efficiency,
        "GBRatio": d.gear_ratio,
        "DTTorSpr": d.stiffness,
        "DTTorDmp": d.damping,
        "TwrFile": "ElastoDyn_tower.dat",
    } | _base(deck)
    outputs = OUTPUTS["ElastoDyn"].split() + AT_SEA * deck.at_sea
    return {
        "ElastoDyn.dat": fill("ElastoDyn", deck.title, values, {"outputs": outputs}),
        "ElastoDyn_blade.dat": _blade(deck, notes, beamdyn),
        "ElastoDyn_tower.dat": _tower(deck, notes),
    }


def _base(deck: ExportModel) -> dict[str, object]:
    """ElastoDyn's values of a platform, or of the top of a pile, where the tower needs inertia about its axis."""
    tower, platform = deck.turbine.tower, deck.turbine.platform
    numbers, lever, mass = [0.0] * 6, 0.0, 0.0
    if platform is not None:
        numbers, mass = [*platform.centre.tolist(), *platform.inertia.tolist()], platform.mass
    elif deck.stands:
        numbers[2] = lever = tower.base_height
        numbers[5] = float(np.trapezoid(0.25 * tower.diameter**2 * tower.mass, tower.position))
    else:
        return {}
    names = [f"PtfmCM{axis}t" for axis in "xyz"] + [f"Ptfm{axis}Iner" for axis in "RPY"]
    values: dict[str, object] = {f"Ptfm{name}DOF": True for name in ("Sg", "Sw", "Hv", "R", "P", "Y")}
    return values | dict(zip(names, numbers, strict=True)) | {"PtfmMass": mass, "PtfmRefzt": lever}


def _blade(deck: ExportModel, notes: DeckNotes, beamdyn: bool) -> str:
    whole = deck.turbine.blade.structure
    ratios = damping_ratios(whole.damping or whole.damping_time, deck.member)
    blade = classical(whole, ratios, (lambda what, why: None) if beamdyn else notes.lost)
    if blade.mode_shapes is None:
        flap, edge = blade_shapes(blade, deck.model)
        _note_shapes(deck, notes, "blade", {"flap": flap, "edge": edge})
    else:
        flap, edge = (_given(modes) for modes in (blade.mode_shapes.flap, blade.mode_shapes.edge))
    assert blade.mass is not None and blade.flap_stiffness is not None and blade.edge_stiffness is not None
    values: dict[str, object] = {
        "NBlInpSt": len(blade.position),
        "BldFlDmp": 100.0 * ratios.flap,
        "BldEdDmp": 100.0 * ratios.edge,
        "AdjBlMs": 1.0,
        **_coefficients(BldFl1Sh=flap[0], BldFl2Sh=flap[1], BldEdgSh=edge[0]),
    }
    sections = (blade.twist * DEGREES, blade.mass, blade.flap_stiffness, blade.edge_stiffness)
    names, units = "BlFract StrcTwst BMassDen FlpStff EdgStff", "- deg kg/m Nm^2 Nm^2"
    stations = table(names, units, blade.position / blade.position[-1], *sections)
    return fill("ElastoDyn blade", deck.title, values, {"stations": stations})


def _tower(deck: ExportModel, notes: DeckNotes) -> str:
    tower = deck.turbine.tower
    if tower.mode_shapes is None:
        model = deck.model
        axis = model.rotor.blade.beam.at(model.rotor.blade_layout.position, "axis")
        pieces = model.rotor.blade.beam.rigid_pieces(model.rotor.blade_layout.edges, axis)
        fore_aft, side_side = tower_shapes(model, head_mass(deck.turbine, pieces, axis))
        if not deck.at_sea:  # the natural modes of the tower on its support
            _note_shapes(deck, notes, "tower", {"fore-aft": fore_aft, "side-side": side_side})
    else:
        fore_aft, side_side = (_given(modes) for modes in (tower.mode_shapes.fore_aft, tower.mode_shapes.side_side))
    values: dict[str, object] = {
        "NTwInpSt": len(tower.position),
        "TwrFADmp": 100.0 * tower.damping.fore_aft,
        "TwrSSDmp": 100.0 * tower.damping.side_side,
        **_coefficients(TwFAM1Sh=fore_aft[0], TwFAM2Sh=fore_aft[1], TwSSM1Sh=side_side[0], TwSSM2Sh=side_side[1]),
    }
    sections = (tower.position / tower.length, tower.mass, tower.fore_aft_stiffness, tower.side_side_stiffness)
    stations = table("HtFract TMassDen TwFAStif TwSSStif", "- kg/m Nm^2 Nm^2", *sections)
    return fill("ElastoDyn tower", deck.title, values, {"stations": stations})


def _note_shapes(deck: ExportModel, notes: DeckNotes, member: str, shapes: Mapping[str, list[Shape]]) -> None:
    """Note the deviation of the polynomials' frequencies from those of the natural modes."""
    natural = deck.model.rotor.blade if member == "blade" else deck.model.rotor.tower
    for kind, fitted in shapes.items():
        for i, shape in enumerate(fitted):
            name = f"{('1st', '2nd')[i]} {kind}"
            if name in natural.names:
                frequency = float(natural.modes.frequency[natural.names.index(name)])
                off = 100.0 * (shape.frequency / frequency - 1.0)
                why = f"polynomial of degree 6: frequency {off:+.2f} % of meltemi's, {frequency / math.tau:.4g} Hz"
                notes.changed(f"{name} mode of the {member}", why)


def _given(modes: Sequence[tuple[float, ...]]) -> list[Shape]:
    """Mode shapes of the turbine description; their frequencies are unknown."""
    return [Shape(coefficients, math.nan) for coefficients in modes]


def _coefficients(**shapes: Shape) -> dict[str, object]:
    return {
        f"{name}({power})": float(c)
        for name, shape in shapes.items()
        for power, c in zip(range(2, 7), shape.coefficients, strict=True)
    }
