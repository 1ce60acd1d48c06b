"""BeamDyn: a blade by its 6 x 6 matrices."""

from __future__ import annotations

import numpy as np

from meltemi.exchange.openfast_writer.deck import DEGREES, OUTPUTS, DeckNotes, ExportModel, Texts
from meltemi.exchange.openfast_writer.sections import damping_times, matrices
from meltemi.exchange.openfast_writer.template import columns, fill, table


def beamdyn_files(deck: ExportModel, notes: DeckNotes) -> Texts:
    """Texts of the BeamDyn file and its blade file."""
    s = deck.turbine.blade.structure
    K, M = matrices(s, notes.changed)
    zero = np.zeros(len(s.position))
    x, y = (zero if value is None else value for value in (s.axis_x, s.axis_y))
    z = s.position
    arc = np.concatenate([[0.0], np.cumsum(np.sqrt(np.diff(x) ** 2 + np.diff(y) ** 2 + np.diff(z) ** 2))])
    values: dict[str, object] = {"kp_total": len(z), "BldFile": "BeamDyn_blade.dat"}
    points = table("kp_xr kp_yr kp_zr initial_twist", "m m m deg", x, y, z, s.twist * DEGREES)
    head = f"     1   {len(z)}   - member, its key points"
    tables = {"key_points": [head, *points], "outputs": OUTPUTS["BeamDyn"].split()}
    texts = {"BeamDyn.dat": fill("BeamDyn", deck.title, values, tables)}
    flap, edge, torsion = damping_times(s.damping or s.damping_time, deck.member)
    if s.damping is not None:
        notes.changed("damping of the blade", "ratios of the first modes as times over stiffness in BeamDyn")
    sections = []
    for share, stiffness, mass in zip(arc / arc[-1], K, M, strict=True):
        sections += [f"{share:.12f}", *columns(*stiffness.T), "", *columns(*mass.T), ""]
    times = ([mu] for mu in (flap, edge, flap, edge, flap, torsion))
    tables = {"damping": table("mu1 mu2 mu3 mu4 mu5 mu6", "s s s s s s", *times), "sections": sections}
    values = {"station_total": len(z), "damp_type": int(any((flap, edge, torsion)))}
    texts["BeamDyn_blade.dat"] = fill("BeamDyn blade", deck.title, values, tables)
    return texts
