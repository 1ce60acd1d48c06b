"""Write a turbine as a functional mock-up unit with the libraries of pythonfmu (FMI 2.0) and pythonfmu3 (3.0)."""

from __future__ import annotations

import base64
import html
import json
import re
import shutil
import sys
import uuid
from datetime import UTC, datetime
from importlib import import_module
from importlib.metadata import version as version_of
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Literal
from zipfile import ZIP_DEFLATED, ZipFile

from meltemi.cases.case import LoadCase, case_turbine, self_contained
from meltemi.core.errors import InputError
from meltemi.core.extras import need
from meltemi.core.files import replacing
from meltemi.core.yamlfile import write_record
from meltemi.exchange.fmu.unit import ABOUT, CASE
from meltemi.turbine.definition import Turbine
from meltemi.turbine.library import write_turbine

COMMUNICATION_STEP = 0.01
"""[s] time step of a unit whose options have none: masters usually call it in multiples of it."""
ICON = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAACAAAAAgAQAAAABbAUdZAAAANElEQVR42mP4DwQM///Xk0X8kwcSP/iBxANmINFmACT4LOoZ/tjZyTP8+Wc/H6"
    "jE/j8lBADKxmY4kO1waQAAAABJRU5ErkJggg=="
)
SCRIPT = """\
import {package}
from meltemi.exchange.fmu.library import keep
from meltemi.exchange.fmu.unit import Unit

keep(globals())
{base} = type("{base}", (Unit, {package}.{base}), {{}})  # the library looks for the one name in the brackets below


class Turbine({base}):
    pass
"""


def export_fmu(case: LoadCase, path: str | Path, *, fmi: Literal["2.0", "3.0"] = "3.0", folder: Path = Path()) -> Path:
    """Write the turbine of a case as a co-simulation unit, which runs where a Python with meltemi is.

    Args:
      case: turbine, controller, wind, options and channels; with the controller ``fixed`` the master sets the demands.
      path: path of the ``.fmu`` file.
      fmi: version of the standard.
      folder: folder to which paths of the case are relative.

    Returns:
      The path.

    Raises:
      InputError: the file name or version is not supported, a package is missing, or the case cannot run.
    """
    path = Path(path)
    if path.suffix != ".fmu":
        raise InputError(f"{path}: expected the ending .fmu")
    if fmi not in ("2.0", "3.0"):
        raise InputError(f"fmi: expected '2.0' or '3.0', found {fmi!r}")
    package, base = ("pythonfmu", "Fmi2Slave") if fmi == "2.0" else ("pythonfmu3", "Fmi3Slave")
    need(f"an FMU of FMI {fmi}", package)
    turbine, case = case_turbine(case, folder), self_contained(case, folder)
    if case.options.time_step is None and isinstance(turbine, Turbine):
        case = case.replace(options=case.options.replace(time_step=COMMUNICATION_STEP))
    identifier = re.sub(r"\W", "_", path.stem)
    identifier = identifier if identifier[0].isalpha() else f"turbine_{identifier}"
    about = {
        "modelName": path.stem,
        "modelIdentifier": identifier,
        "token": str(uuid.uuid4()),
        "version": fmi,
        "description": f"{turbine.name}: {case.controller.kind} controller, {case.wind.kind} wind",
        "generationTool": f"meltemi {version_of('meltemi')}",
        "generationDateAndTime": datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
    }
    with TemporaryDirectory(prefix="meltemi_fmu_") as temporary:
        source, built = Path(temporary) / "resources", Path(temporary) / "built"
        source.mkdir()
        write_turbine(turbine, source / "turbine.yaml")
        # the turbine has ice, flaps and electrical system already
        changed = {"turbine": "turbine.yaml", "icing": None, "imbalance": None, "electrical": None}
        write_record(_with_files(case, source).replace(**changed), source / CASE)
        (source / ABOUT).write_text(json.dumps(about), encoding="utf-8")
        script = source / f"meltemi_{package}.py"
        script.write_text(SCRIPT.format(package=package, base=base), encoding="utf-8")
        beside = [file for file in source.iterdir() if file != script]
        name = script.stem
        try:
            unit_file = import_module(f"{package}.builder").FmuBuilder.build_FMU(script, built, project_files=beside)
        finally:  # the builder imports the script by its name
            sys.modules.pop(name, None)
            sys.path[:] = [entry for entry in sys.path if entry != str(source)]
        words = _documentation(about, unit_file)
        with ZipFile(unit_file, "a", ZIP_DEFLATED) as file:
            file.writestr("documentation/index.html", words)
            file.writestr("model.png" if fmi == "2.0" else "terminalsAndIcons/icon.png", ICON)
        with replacing(path) as (partial,):
            shutil.copyfile(unit_file, partial)
    return path


def _with_files(case: LoadCase, folder: Path) -> LoadCase:
    """The case with the wind and controller files that have to be packed with it."""
    changes = {}
    for part in ("wind", "controller"):
        for key in ("file", "hub_file", "library", "input"):
            given = getattr(getattr(case, part), key, None)
            if given is not None and Path(given).is_file():
                shutil.copy2(given, folder / Path(given).name)
                changes[f"{part}.{key}"] = Path(given).name
    return case.replace(**changes) if changes else case


def _documentation(about: dict[str, str], description_file: Path) -> str:
    """Documentation page of the unit with a table of its variables."""
    with ZipFile(description_file) as file:
        text = file.read("modelDescription.xml").decode()
    rows = "".join(
        f"<tr><td>{name}</td><td>{causality}</td><td>{words}</td></tr>\n" for name, causality, words in _rows(text)
    )
    return (
        f"<!doctype html><meta charset=utf-8><title>{html.escape(about['modelName'])}</title>\n"
        f"<h1>{html.escape(about['modelName'])}</h1><p>{html.escape(about['description'])}; {about['generationTool']}, "
        "SI units. The machine that runs this unit needs a Python with meltemi. Communication steps are multiples of "
        "the step size of the default experiment. Channels, loads and accelerations are those of the last time step, "
        f"measured motions those of the present time.</p>\n<table>{rows}</table>\n"
    )


def _rows(text: str) -> list[tuple[str, str, str]]:
    from xml.etree.ElementTree import fromstring

    listed = fromstring(text).find("ModelVariables")
    assert listed is not None
    return [(v.get("name", ""), v.get("causality", ""), html.escape(v.get("description", ""))) for v in listed]
