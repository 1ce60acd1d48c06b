"""Turbines from windIO files (IEA Wind Task 37, version 2)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

import numpy as np

from meltemi.core.errors import InputError
from meltemi.core.record import set_keys
from meltemi.core.yamlfile import merged, read_mapping, validated
from meltemi.exchange.report import ImportedTurbine
from meltemi.exchange.windio.blade import read_blade
from meltemi.exchange.windio.control import GAINS, read_control, rotor_inertia
from meltemi.exchange.windio.defaults import supply
from meltemi.exchange.windio.machine import given, read_actuator, read_drivetrain, read_hub, read_nacelle, read_yaw
from meltemi.exchange.windio.tower import read_pile, read_tower
from meltemi.exchange.windio.tree import Tree, load
from meltemi.turbine.definition import Turbine

Extra = Mapping[str, Any] | str | Path | None


def read_windio(path: str | Path, extra: Extra = None, **how: Any) -> Turbine:
    """Read the turbine of a windIO 2 file; see :func:`import_windio` for arguments and errors."""
    return import_windio(path, extra, **how).turbine


@np.errstate(all="ignore")  # the record reports values that are not finite by their name
def import_windio(
    path: str | Path,
    extra: Extra = None,
    *,
    foundation: Literal["clamped", "pile"] = "clamped",
    mudline: float | None = None,
    reynolds: float | None = None,
) -> ImportedTurbine:
    """Read a windIO 2 file, with notes on data used, approximated and ignored.

    Args:
      path: the YAML file, of windIO 2.0 or 2.1.
      extra: supplementary or replacing data: a YAML file with keys as in a turbine file, or a dictionary of the same
        or of key paths, ``{"yaw.stiffness": 6e9}``. It takes precedence over the file.
      foundation: the tower is clamped at its base, or stands on the file's monopile.
      mudline: [m] height, negative under water, where the monopile is clamped.
      reynolds: where an airfoil has polars of several Reynolds numbers, the nearest is used; by default the highest.

    Raises:
      InputError: the file is no windIO 2 turbine, or data are invalid or missing; all missing data are listed.
    """
    if foundation not in ("clamped", "pile"):
        raise InputError(f"read_windio: foundation must be 'clamped' or 'pile', found {foundation!r}")
    tree = load(Path(path))
    more = _extra(extra)
    data = _content(tree, more, reynolds)
    if foundation == "pile":
        if mudline is None:
            raise InputError(
                f"{path}: foundation 'pile' needs mudline, the height [m] (negative under water) where the monopile is "
                "clamped; windIO files do not contain it"
            )
        data["foundation"] = read_pile(tree, mudline)
    elif tree.get("components.monopile") is not None or tree.get("components.floating_platform") is not None:
        tree.note("ignored", "components.monopile", "substructure", "the tower is clamped at its base")
    for name in ("jacket", "floating_platform", "mooring", "RNA"):
        if tree.get(f"components.{name}") is not None:
            tree.note("ignored", f"components.{name}", name, "not modelled")
    supply(data, more, tree)
    _note_given(tree, more)
    turbine = _validated(merged(data, more), str(path), extra)
    tree.note_used()
    return ImportedTurbine(turbine, tuple(tree.notes))


SUPPLIED = {
    GAINS: "control.pitch.proportional_gain",
    "optimal gain": "control.torque.optimal_gain",
    "largest torque": "control.torque.maximum_torque",
    "filter of the generator speed": "control.filter_frequency",
    "centre of mass of the hub": "hub.mass_centre",
    "pitch actuator": "pitch_actuator.natural_frequency",
}
"""Our keys of what is approximated; beside the file they take its place."""


def _note_given(tree: Tree, more: Mapping[str, Any]) -> None:
    """Add notes on supplementary data, which take precedence over the file."""
    keys = list(_paths(more))
    replaced = [note for note in tree.notes if SUPPLIED.get(note.what) in keys]
    tree.notes[:] = [note for note in tree.notes if note not in replaced]
    for note in replaced:
        if tree.get(note.where) is not None:
            tree.note("ignored", note.where, note.what, f"{SUPPLIED[note.what]} is given beside the file")
    for key in keys:
        tree.note("used", "extra", key, "supplementary data, which take precedence over the file")


def _paths(content: Mapping[str, Any], above: str = "") -> Iterator[str]:
    for key, value in content.items():
        if isinstance(value, Mapping):
            yield from _paths(value, f"{above}{key}.")
        else:
            yield f"{above}{key}"


NUMBERS = (
    *("radius", "inertia", "mass", "yaw_inertia", "overhang"),
    *("gear_ratio", "generator_inertia", "generator_efficiency"),
)
"""Values of hub, nacelle and drivetrain by which control and yaw bearing are scaled before all are checked."""


def _content(tree: Tree, more: dict[str, Any], reynolds: float | None) -> dict[str, Any]:
    """Content of a turbine, as far as available in the file."""
    if str(tree.get("assembly.rotor_orientation") or "upwind").lower() != "upwind":
        raise InputError(f"{tree.where}: assembly.rotor_orientation: upwind rotors only")
    blades = int(tree.number("assembly.number_of_blades") or 3)
    blade, airfoils = read_blade(tree, reynolds)
    hub, drivetrain = read_hub(tree), read_drivetrain(tree)
    for part, inner in more.items():
        if part not in ("hub", "nacelle", "drivetrain"):
            continue
        if not isinstance(inner, dict):
            raise InputError(f"{part} beside {tree.where}: expected a dictionary of keys, found {inner!r:.60}")
        for key, value in inner.items():
            if key in NUMBERS and not (
                isinstance(value, int | float) and 0.0 <= value < 1e30 and (value > 0.0 or "inertia" in key)
            ):
                raise InputError(f"{part}.{key} beside {tree.where}: expected a positive number, found {value!r:.60}")
    drive = drivetrain | more.get("drivetrain", {})
    if "generator_efficiency" not in drive:
        why = "no losses; give drivetrain.generator_efficiency"
        tree.note("approximated", "components.drivetrain.generator.rpm_efficiency", "generator efficiency", why)
    control = read_control(
        tree,
        rotor_inertia(blade, hub | more.get("hub", {}), blades),
        drive.get("gear_ratio", 1.0),
        drive.get("generator_inertia", 0.0),
        drive.get("generator_efficiency", 1.0),
    )
    name = str(tree.get("name") or Path(tree.where).stem)
    return {
        "name": name,
        "description": str(tree.get("comments") or name),
        "source": f"{tree.source} (windIO {tree.get('windIO_version') or 2})",
        "n_blades": blades,
        **given(
            rated_power=tree.number("assembly.rated_power") or tree.number("control.rated_power"),
            cut_in=tree.number("assembly.cut_in_wind_speed"),
            cut_out=tree.number("assembly.cut_out_wind_speed"),
        ),
        "blade": blade,
        "airfoils": airfoils,
        "hub": hub,
        "nacelle": read_nacelle(tree),
        "drivetrain": drivetrain,
        "yaw": read_yaw(tree),
        "tower": read_tower(tree),
        "pitch_actuator": read_actuator(tree),
        "control": control,
    }


def _extra(extra: Extra) -> dict[str, Any]:
    """Supplementary data, as nested keys."""
    if extra is None:
        return {}
    if isinstance(extra, (str, Path)):
        return read_mapping(extra)
    nested: dict[str, Any] = {}
    for path, value in extra.items():
        set_keys(nested, str(path), value)
    return nested


def _validated(data: dict[str, Any], where: str, extra: Extra) -> Turbine:
    names = [Path(where).name] + ([Path(extra).name] if isinstance(extra, (str, Path)) else [])
    try:
        return validated(data, Turbine, " with ".join(names))
    except InputError as error:
        hint = "supply the missing data with extra, a YAML file or a dictionary of these keys"
        raise InputError(f"{where}: incomplete turbine; {hint}:\n{error}") from None
