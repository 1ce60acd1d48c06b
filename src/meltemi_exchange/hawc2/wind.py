"""The wind of a HAWC2 model as keys of a case file: steady, or a turbulence box whose files exist.

HAWC2 plays a box with its last plane first (:func:`meltemi.io.read_hawc2`). Its mean wind has the speed ``wsp`` at the
middle of the box, ``center_pos0``; ``shear_format`` 0 has none, as its output shows (h2lib-tests 13.2.2103).
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from meltemi.core.errors import InputError
from meltemi_exchange.boxes import Profile, box_case
from meltemi_exchange.hawc2.htc import Block, Command, file_of
from meltemi_exchange.report import ImportNote, Kind

PROFILES: dict[str, Profile] = {"0": "none", "1": "constant", "2": "log", "3": "power"}


def read_wind(wind: Block, path: Path, notes: list[ImportNote]) -> dict[str, Any]:
    """The ``wind`` of a case file, with absolute paths.

    Raises:
      InputError: with file, line and command.
    """
    shear, centre, form = (wind.get(name) for name in ("shear_format", "center_pos0", "turb_format"))
    law = "1" if shear is None else shear.values[0]
    profile = PROFILES.get(law, "constant")
    value = wind.value("shear_format", 0.0, 1) if profile in ("log", "power") else 0.0
    if shear is not None and law not in PROFILES:
        _note(notes, shear, "ignored", "only shear_format 0 to 3 are read; the case has no shear")
    if form is not None and form.values[:1] == ("1",):
        try:
            found = _box(wind, wind.find("mann"), path, profile, value)
        except InputError as error:
            _note(notes, form, "ignored", f"the case has steady wind: {error}")
        else:
            _note_box(wind, form, notes)
            return found
    if shear is not None and profile == "none":
        _note(notes, shear, "ignored", "no mean wind in HAWC2; the case has the speed wsp without shear")
    steady: dict[str, Any] = {"kind": "steady", "speed": wind.value("wsp", 10.0)}
    if profile in ("log", "power"):
        steady["roughness" if profile == "log" else "shear_exponent"] = value
        if centre is not None and (height := -float(centre.numbers(2, 1)[0])) > 0.0:
            steady["reference_height"] = height
            _note(notes, centre, "used", "reference height of the mean wind")
    return steady


def _note_box(wind: Block, form: Command, notes: list[ImportNote]) -> None:
    """Replace the notes on the commands of a box that is used."""
    mann, centre = wind.find("mann"), wind.need("center_pos0")
    _note(notes, form, "used", "the case has the box of the block mann, its last plane first")
    for c in "uvw":
        _note(notes, mann.need(f"filename_{c}"), "used", "wind.file")
        _note(notes, mann.need(f"box_dim_{c}"), "used", "wind.grid")
    why = "height of the middle of the box; in the case it is centred on the tower, where plane 0 is at time 0"
    _note(notes, centre, "approximated" if any(centre.numbers(0, 2)) else "used", why)


def _box(wind: Block, mann: Block, path: Path, profile: Profile, value: float) -> dict[str, Any]:
    scaled = mann.get("dont_scale")
    if scaled is None or scaled.numbers(0, 1)[0] != 1.0:
        raise InputError("HAWC2 scales its box to tint unless dont_scale is 1: specify a scaled wind file for the run")
    if mann.get("factor_scaling") is not None:
        raise InputError("factor_scaling is not read: specify a scaled wind file for the run")
    files = [file_of(path, (named := mann.need(f"filename_{c}")).values[0], named.where) for c in "uvw"]
    points, steps = zip(*(mann.need(f"box_dim_{c}").numbers(0, 2) for c in "uvw"), strict=True)
    height = -float(wind.need("center_pos0").numbers(2, 1)[0])
    speed = wind.value("wsp", 10.0)
    return box_case(files, points, steps, speed=speed, height=height, front="last", profile=profile, value=value)


def _note(notes: list[ImportNote], command: Command, kind: Kind, why: str) -> None:
    """Replace the note on a command."""
    where = command.where.rsplit("/", 1)[-1]
    notes[:] = [ImportNote(kind, n.where, n.what, why) if n.where == where else n for n in notes]
