"""``meltemi import``: OpenFAST decks, HAWC2 models and windIO files as turbine file, case file and report."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import meltemi
from meltemi.app.options import TURBINES, load_aeroelastic
from meltemi.app.terminal import OutOption, print_table, say, simulation_bar, suggest, warn, wrote
from meltemi.core.errors import InputError

if TYPE_CHECKING:
    from meltemi.exchange.report import ImportedModel, ImportedTurbine

SOURCES = {".yaml": "a windIO file", ".yml": "a windIO file", ".htc": "a HAWC2 model"}


def import_(
    source: Annotated[Path, "Main file of an OpenFAST deck (.fst) or HAWC2 model (.htc), or a windIO file (.yaml)."],
    blade: Annotated[
        Literal["deck", "elastodyn", "beamdyn"],
        "Sections of the blade: deck (those that it selects), elastodyn, beamdyn.",
    ] = "deck",
    fixed_base: Annotated[bool, "Clamp the tower of a floating turbine at its base."] = False,
    momentum_wake: Annotated[bool, "Momentum theory in place of a vortex wake."] = False,
    discon: Annotated[Path | None, "Settings of ROSCO (DISCON.IN) in place of the deck's."] = None,
    control_of: Annotated[str | None, "Turbine whose control is taken, for other controllers.", TURBINES] = None,
    start: Annotated[
        Literal["operating", "deck"], "Initial state: operating (steady operation), or deck (as in OpenFAST or HAWC2)."
    ] = "operating",
    extra: Annotated[Path | None, "YAML file with overriding values: drivetrain: {stiffness: 8.7e8}."] = None,
    out: OutOption = Path("out"),
) -> None:
    """Convert an OpenFAST deck (.fst), a HAWC2 model (.htc) or a windIO file (.yaml) to a turbine file, with a report.

    The files are the turbine, the case (not of windIO) and the report.
    """
    from meltemi.core.yamlfile import read_mapping, write_record
    from meltemi.exchange.hawc2 import import_hawc2
    from meltemi.exchange.windio.gains import with_tuned_gains

    of_decks = {"--blade": blade != "deck", "--fixed-base": fixed_base, "--momentum-wake": momentum_wake}
    of_decks["--discon"] = discon is not None
    kind = _kind(source, of_decks, {"--control-of": control_of is not None, "--start": start == "deck"})
    if kind == "a windIO file":
        imported = meltemi.io.import_windio(source, extra)
        paths = flat(read_mapping(extra)) if extra else {}
        control_values = {path.removeprefix("control."): x for path, x in paths.items() if path.startswith("control.")}
        if "pitch.proportional_gain" not in control_values:
            with simulation_bar("pitch gains with margins"):
                imported = with_tuned_gains(imported, control_values)
        _show(imported)
        _write(imported, source, out)
        wrote(out / "turbine.yaml", out / "report.md")
        suggest("run", out / "turbine.yaml", "--wind-speed", 12)
        return
    more: dict[str, Any] = {
        "control_of": None if control_of is None else load_aeroelastic(control_of, "--control-of"),
        "extra": None if extra is None else flat(read_mapping(extra)),
    }
    deck: ImportedModel
    if kind == "a HAWC2 model":
        deck = import_hawc2(source, **more)
    else:
        more |= {"fixed_base": fixed_base, "momentum_wake": momentum_wake, "discon": discon}
        deck = meltemi.io.read_deck(source, blade=blade, **more)
    controller, note = meltemi.io.deck_controller(deck)
    case = meltemi.io.deck_case(deck, "turbine.yaml", started=start == "deck", controller=controller)
    _show(deck)
    if note:
        say(f"note: {note}")
    if deck.wind is None:
        print(f"the wind of the deck is not supported in a case file; the case has {case.wind.model_dump()} instead")
    settings = _write(deck, source, out)
    if case.controller.kind == "bladed":
        case = case.replace(**{"controller.input": settings})
    write_record(case, out / "case.yaml")
    wrote(out / "turbine.yaml", out / "case.yaml", out / "report.md")
    suggest("run", out / "case.yaml")


def _kind(source: Path, of_decks: dict[str, bool], of_models: dict[str, bool]) -> str:
    """The format of the source file; raises an error if an option of another format is used."""
    kind = SOURCES.get(source.suffix.lower(), "an OpenFAST deck")
    for option, used in {**of_decks, **(of_models if kind == "a windIO file" else {})}.items():
        if used and kind != "an OpenFAST deck":
            owner = "OpenFAST decks" if option in of_decks else "OpenFAST decks and HAWC2 models"
            raise InputError(f"{option} is for {owner}, {source} is {kind}")
    return kind


def _show(imported: ImportedTurbine) -> None:
    """Print approximated and ignored data, the number of notes and implausible values."""
    from meltemi.exchange.report import KINDS

    for title, head, rows in imported.tables():
        print_table(title, head, rows, text_columns=3)
    print(", ".join(f"{len(imported.noted(kind))} {kind}" for kind in KINDS) + ": see the report")
    warn(meltemi.turbine.plausibility_warnings(imported.turbine))


def _write(imported: ImportedTurbine, source: Path, out: Path) -> str | None:
    """Write the turbine, the report and the ROSCO settings; return the name of the settings file."""
    from meltemi.core.files import write_text

    turbine = imported.turbine
    if turbine.platform is not None and turbine.platform.coefficients:
        from meltemi.floating.coefficients import read_coefficients, write_coefficients

        packed = out / "coefficients.npz"
        write_coefficients(read_coefficients(turbine.platform.coefficients), packed)
        turbine = turbine.replace(platform=turbine.platform.replace(coefficients=packed.name))
        wrote(packed)
    if turbine.control.discon is not None:
        turbine = turbine.replace(**{"control.discon": _settings(Path(turbine.control.discon), out)})
    meltemi.io.write_turbine(turbine, out / "turbine.yaml")
    write_text(out / "report.md", meltemi.io.report_text(imported.notes, f"{source.name} as a turbine"))
    return turbine.control.discon


def _settings(source: Path, out: Path) -> str:
    """Copy settings of ROSCO, and the table of coefficients that they name; returns the name of the copy."""
    from meltemi.exchange.openfast.text import read_input

    target, changes = out / source.name, {}
    if target.exists() and target.samefile(source):
        return source.name
    settings = read_input(source, "DISCON")
    named = settings.find("PerfFileName")
    table = None if named is None else source.parent / named.values[0]
    if table is not None and table.is_file():
        shutil.copyfile(table, out / table.name)
        changes["PerfFileName"] = f'"{table.name}"'
        wrote(out / table.name)
    wrote(meltemi.control.edit_discon(source, target, **changes))
    return source.name


def flat(data: Any, path: str = "") -> dict[str, Any]:
    """Flatten nested keys to key paths: ``{"drivetrain": {"stiffness": 1.0}}`` is ``{"drivetrain.stiffness": 1.0}``."""
    if not isinstance(data, dict) or not data:
        return {path: data}
    flattened: dict[str, Any] = {}
    for name, value in data.items():
        flattened |= flat(value, f"{path}.{name}" if path else str(name))
    return flattened
