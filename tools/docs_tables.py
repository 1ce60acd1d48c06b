"""Tables of the documentation, made from the package itself when the pages are built.

A line ``{{ name }}`` or ``{{ name argument }}`` in a page is replaced by the table that the function of
that name below returns.
"""

from __future__ import annotations

import re
from typing import Any, get_args, get_origin

from pydantic import BaseModel

from meltemi.compiler import Table, TableClass
from meltemi.core.usual import usual_range

RUN = "turbine-run.nc"
"""Of ``docs/images``: the result that the guide shows in three dimensions, by the command on its page."""
PLACE = re.compile(r"^\{\{ (\w+)(?: ([\w.]+))? \}\}$", re.MULTILINE)


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Called by mkdocs for every page."""
    return PLACE.sub(lambda m: MAKERS[m[1]](m[2]) if m[2] else MAKERS[m[1]](), markdown)


def on_files(files: Any, *, config: Any, **_: Any) -> Any:
    """Called by mkdocs with the files of the site: adds the page of the three-dimensional view."""
    from mkdocs.structure.files import File

    import meltemi

    run = next(file for file in files if file.src_uri == f"images/{RUN}")
    page = meltemi.plots.view(meltemi.read_result(run.abs_src_path))
    files.append(File.generated(config, "guide/turbine.html", content=page.html))
    files.remove(run)
    return files


def _table(head: list[str], rows: list[list[str]]) -> str:
    from meltemi.report.tables import markdown_table

    return "\n".join(markdown_table(head, rows))


def record(path: str) -> str:
    """Keys of a record class of meltemi: ``turbine.definition.Hub``."""
    from importlib import import_module

    module, name = path.rsplit(".", 1)
    home = import_module(f"meltemi.{module}")
    kind: type[BaseModel] = getattr(home, name)
    rows = []
    for key, field in kind.model_fields.items():
        if field.is_required():
            default = "required"
        elif isinstance(field.get_default(call_default_factory=True), BaseModel):
            default = "see there"
        else:
            default = f"`{field.get_default(call_default_factory=True)!r}`"
        limits = ", ".join(
            f"{sign} {getattr(rule, which)}"
            for rule in field.metadata
            for which, sign in (("gt", ">"), ("ge", "≥"), ("lt", "<"), ("le", "≤"))
            if getattr(rule, which, None) is not None
        )
        meaning, usual = field.description or "", usual_range(field.description)
        shown = ""
        if usual is not None:
            shown = f"{usual.least:g} to {usual.most:g}{'' if usual.power is None else ' at 100 m'}"
            meaning = re.sub(r"\[([^\];]*);[^\]]*\]", r"[\1]", meaning, count=1)
        rows.append([f"`{key}`", _kind(field.annotation), default, limits, shown, meaning])
    head = ["key", "value", "default", "limits", "usual", "meaning"]
    if not any(row[4] for row in rows):
        head, rows = [*head[:4], head[5]], [[*row[:4], row[5]] for row in rows]
    return _table(head, rows)


def _kind(annotation: Any) -> str:
    from typing import Annotated, Literal

    from numpy import ndarray

    origin, inside = get_origin(annotation), get_args(annotation)
    if origin is Annotated:
        return _kind(inside[0])
    if origin is Literal:
        return " or ".join(f"`{v}`" for v in inside)
    if origin is ndarray or annotation is ndarray:
        return "numbers"
    if origin is tuple:
        return f"list of {_kind(inside[0]).removesuffix('s')}s" if inside[-1] is Ellipsis else f"{len(inside)} numbers"
    if origin is dict:
        return f"{_kind(inside[1])} by name"
    if inside:
        return " or ".join(_kind(a) for a in inside if a is not type(None))
    return {float: "number", int: "integer", str: "text", bool: "true or false"}.get(annotation, annotation.__name__)


def names(namespace: str) -> str:
    """Public names of a namespace, e.g. ``meltemi.wind``, with the first line of their documentation."""
    from importlib import import_module
    from inspect import getdoc

    from meltemi.namespaces import NAMESPACES, declared

    home = import_module(namespace)
    rows = []
    for name in sorted(declared(namespace), key=str.lower):
        value = getattr(home, name)
        told = isinstance(value, type) or callable(value) or name in NAMESPACES
        first = (getdoc(value) or "").partition("\n\n")[0] if told else ""
        rows.append([f"`{name}`", re.sub(r":\w+:`", "`", first).replace("``", "`")])
    return _table(["name", "what"], rows)


def events() -> str:
    """Kinds of events with their own keys."""
    from meltemi.simulation.events import KINDS, TemporaryEvent

    rows = []
    for kind in KINDS:
        keys = []
        for key, field in kind.model_fields.items():
            if key not in ("at", "until", "type"):
                default = "" if field.is_required() else f" [`{field.get_default()!r}`]"
                values = f" ({_kind(field.annotation)})" if get_args(field.annotation) else ""
                keys.append(f"`{key}`{default}: {field.description}{values}")
        ends = ["`until`"] if issubclass(kind, TemporaryEvent) else []
        text = (kind.__doc__ or "").strip().replace("``", "`")
        rows.append([f"`{kind.model_fields['type'].default}`", "<br>".join(keys + ends), text])
    return _table(["type", "keys", "what happens"], rows)


def channels(group: str) -> str:
    """Channels of a group: machine, disk, gearbox, electrical, blade, flap, node, station, tower_station, sea,
    pile_station, platform, line."""
    from meltemi.simulation.channels import ChannelSet, catalogue, channels_of_group

    if group in ("sea", "pile_station", "platform", "line"):
        return _channel_table(channels_of_group(group, 1))
    further = channels_of_group("electrical") + channels_of_group("disk")
    all_channels = catalogue(
        ChannelSet(
            blades=1,
            nodes=1,
            blade_stations=1,
            tower_stations=1,
            flaps=1,
            gears=(1, 2),
            further=further,
        )
    )
    chosen = []
    for c in all_channels.values():
        first, *_ = c.name.split("_")
        home = {"node": "node", "station": "station", "flap": "flap"}.get(
            first, "blade" if c.name.endswith("_1") else "machine"
        )
        if c.name.startswith("tower_station"):
            home = "tower_station"
        homes = {"gear_loads": "gearbox", "electric": "electrical", "disk_flow": "disk"}
        home = homes.get(c.source[0], home)
        if home == group:
            chosen.append(c)
    return _channel_table(chosen)


def _channel_table(chosen: Any) -> str:
    rows = [[f"`{c.name}`", c.alias, c.unit, c.frame, c.sign, c.description] for c in chosen]
    return _table(["name", "OpenFAST", "unit", "axes", "positive", "what"], rows)


def openfast_channels() -> str:
    """Channels by OpenFAST's names, with all that it has for each."""
    from meltemi.simulation.channels import ChannelSet, catalogue

    known = catalogue(ChannelSet(blades=1, nodes=1, blade_stations=1, tower_stations=1, flaps=1)).values()
    rows = [
        [f"`{c.alias}`", ", ".join(f"`{name}`" for name in c.also), f"`{c.name}`", c.description]
        for c in sorted(known, key=lambda c: c.alias.lower())
        if c.alias
    ]
    return _table(["OpenFAST", "also", "meltemi", "what"], rows)


def openfast_only() -> str:
    """Channels that OpenFAST has and meltemi has not."""
    from meltemi.simulation.openfast_only import openfast_only as kinds

    rows = [
        [kind.module, f"`{kind.names}`".replace("|", "\\|"), kind.what, kind.instead.replace(";", ",")]
        for kind in kinds().values()
    ]
    return _table(["module", "names", "what", "similar in meltemi"], rows)


def openfast_units() -> str:
    """Units of OpenFAST's files and their SI units."""
    from meltemi.postprocess.files.openfast import UNITS

    theirs: dict[str, list[str]] = {}
    for unit, (si, factor) in UNITS.items():
        if unit != "-":
            theirs.setdefault(si, []).append(f"`{unit}`" if factor == 1.0 else f"`{unit}` (times {factor:.8g})")
    return _table(["SI", "OpenFAST"], [[si, ", ".join(units)] for si, units in theirs.items()])


def wind_formats() -> str:
    """Formats of wind files."""
    from meltemi.wind_files.formats import FORMATS

    rows = [
        [f"`{f.name}`", f"`{f.suffix}`", f.text, ", ".join(f"`{kind}`" for kind in f.holds), f.note] for f in FORMATS
    ]
    return _table(["name", "suffix", "content", "written from", "read by"], rows)


def result_formats() -> str:
    """Formats of result files."""
    from meltemi.postprocess.formats import FORMATS

    return _table(["suffix", "content", "preserves"], [[f"`{f.suffix}`", f.text, f.note] for f in FORMATS])


def keywords(file: str) -> str:
    """Keywords of a file of an OpenFAST deck, with an underscore for a blank in its name."""
    from meltemi.exchange.openfast.keywords import ROWS

    rows = []
    for row in ROWS[file.replace("_", " ")]:
        target = "" if not row.target else f"`{row.target}`" if "." in row.target else f"({row.target})"
        names = ", ".join(f"`{name}`" for name in row.names)
        kind = row.kind + (" or default" if row.optional else "") if row.target else ""
        rows.append([names, kind, row.unit, ("-" if row.turned else "") + target, row.same, row.remark])
    return _table(["keyword", "value", "unit", "to", "same", "remark"], rows)


def array(path: str) -> str:
    """Fields of a table, e.g. ``control.signals.Measurements``."""
    from importlib import import_module

    module, name = path.rsplit(".", 1)
    found: type[Table] = getattr(import_module(f"meltemi.{module}"), name)
    rows = [[f"`{f.name}`", f.unit, f.doc] for f in found.rows]
    axes = f"Axes: field, {', '.join(found.axes)}.\n\n" if found.axes else ""
    return axes + _table(["field", "unit", "meaning"], rows)


def arrays() -> str:
    """All tables of the package."""
    from importlib import import_module

    parts = []
    for module in (
        "turbine.exchange",
        "wind.velocity",
        "structure.tables",
        "floating.moving_base",
        "aero.tables",
        "aero.flaps",
        "aero.coefficient",
        "control.signals",
        "control.baseline",
        "control.actuators",
        "control.faults",
        "control_laws.feedforward",
        "control_laws.integrator",
        "control_laws.harmonic",
        "control_laws.preview",
        "control_laws.load_control",
        "control_laws.yaw",
        "control_laws.moving_mean",
        "supervisor.tables",
        "supervisor.log",
        "supervisor.supervised",
        "electrical.tables",
        "vortex.tables",
        "simulation.step",
        "simulation.disk.system",
    ):
        home = import_module(f"meltemi.{module}")
        for name, found in vars(home).items():
            if isinstance(found, TableClass) and found.__module__ == home.__name__:
                parts += [f"## {found.title}", f"`meltemi.{module}.{name}`. " + array(f"{module}.{name}")]
    return "\n\n".join(parts)


def schemes() -> str:
    """Control schemes of ``meltemi compare``."""
    from meltemi.controllers.names import SCHEMES

    return _table(["scheme", "what"], [[f"`{name}`", scheme.about] for name, scheme in SCHEMES.items()])


def controllers() -> str:
    """Names of controllers."""
    from meltemi.controllers.names import NAMES

    return _table(["name", "controller"], [[f"`{name}`", about] for name, about in NAMES.items()])


def swap() -> str:
    """Records that controller libraries read and write."""
    from meltemi.bladed_controllers.records import RECORDS

    ways = {"to": "to the library", "from": "from the library", "none": "not used"}
    rows = [[str(r.number), r.unit, ways[r.way], r.source if r.way != "none" else "", r.meaning] for r in RECORDS]
    return _table(["record", "unit", "", "filled from, or becomes", "meaning"], rows)


def supervisor(what: str) -> str:
    """States, conditions or transitions of the supervisor; with ``yaw_`` before it those of yaw protection."""
    from meltemi.supervisor import tables

    def words(name: str) -> str:
        return name.replace("_", " ")

    states = tables.YAW_STATES if what.startswith("yaw_") else tables.STATES
    lines = tables.YAW_TRANSITIONS if what.startswith("yaw_") else tables.TRANSITIONS
    if what == "states":
        head = ["", "state", "torque", "pitch", "pitch rate", "brake", "yaw", "what"]
        cells = [[words(a.name), a.torque, a.pitch, a.rate, a.brake, a.yaw, a.doc] for a in states]
        return _table(head, [[str(i), *row] for i, row in enumerate(cells, 1)])
    if what == "yaw_states":
        return _table(["", "state", "what"], [[str(i), words(a.name), a.doc] for i, a in enumerate(states, 1)])
    if what == "conditions":
        head = ["condition", "quantity", "", "limit", "for", "latches", "quantity is"]
        docs = {f.name: f"{f.doc} [{f.unit}]" for f in tables.Quantities.rows}
        rows = [
            [words(c.name), words(c.quantity), c.sense, f"`{c.limit}`", "" if c.hold == "0" else f"`{c.hold}`"]
            + ["yes" if c.latches else "", docs[c.quantity]]
            for c in tables.CONDITIONS
        ]
        return _table(head, rows)
    rows = [[", ".join(map(words, a.sources)), words(a.target), words(", ".join(a.conditions))] for a in lines]
    return _table(["from", "to", "when"], rows)


def load_cases(part: str) -> str:
    """Rows or faults of the load case table of edition 4, with those values in italics that come from practice; or what
    the sea adds to the rows (``sea``, ``floating``)."""
    from meltemi.loads.loadbase.table import load_table, names_in
    from meltemi.loads.loadbase.wording import event_words

    def words(events: Any) -> str:
        return "; ".join(map(event_words, events)) if isinstance(events, tuple) else f"{events}"

    table = load_table(4)
    if part == "faults":
        used = {name: [r for r, row in table.rows.items() if name in names_in(row.faults)] for name in table.faults}
        rows = [[f"`{n}`", f.title, words(f.events), ", ".join(used[n])] for n, f in table.faults.items()]
        return _table(["fault", "meaning", "events", "rows"], rows)
    if part in ("sea", "floating"):
        table = load_table("61400-3-1" if part == "sea" else "61400-3-2")
        shown = "wind speeds sea misalignment levels wave seeds type factor characteristic state".split()
        fixed = load_table("61400-3-1").rows
        own = {name: row for name, row in table.rows.items() if part == "sea" or fixed.get(name) != row}
        return _row_table(own, [*shown, *(["faults", "duration"] if part == "floating" else [])])
    shown = "wind speeds yaw senses azimuths instants faults seeds duration type factor characteristic".split()
    return _row_table(table.rows, shown)


def _row_table(of: Any, shown: list[str]) -> str:
    rows = []
    for name, row in of.items():
        cells = {key: "" if getattr(row, key) is None else f"{getattr(row, key)}" for key in shown}
        cells = {key: f"*{cell}*" if cell and key in row.practice else cell for key, cell in cells.items()}
        rows.append([name, f"{row.title}: {row.situation}", *cells.values()])
    return _table(["row", "title: situation", *shown], rows)


def measured(what: str) -> str:
    """Measured and computed values, from the rows that ``meltemi verify --measured`` has written: ``attached``, or a
    quantity at all wind speeds with the models of rotational augmentation beside each other."""
    import csv
    from pathlib import Path

    file = Path(__file__).parents[1] / "docs/verification/measurements.csv"
    with file.open(encoding="utf-8") as text:
        rows = list(csv.DictReader(text))

    def value(text: str) -> str:
        return f"{float(text):.{0 if abs(float(text)) > 100.0 else 3}f}"

    def ours(r: dict[str, str]) -> str:
        deviation = f"{float(r['deviation']):+.1f}".replace("-", "\u2212")
        return f"{value(r['ours'])} ({deviation} %)" if r["measure"] == "%" else value(r["ours"])

    if what == "attached":
        found = [r for r in rows if r["table"] == "uae attached"]
        names = {"N m": " [N m]", "N": " [N]"}
        lines = [[r["what"] + names.get(r["unit"], ""), r["case"], value(r["reference"]), ours(r)] for r in found]
        return _table(["quantity", "where", "measured", "meltemi"], lines)
    what = what.replace("_", " ")
    found = [r for r in rows if r["table"] == "uae stalled" and r["what"].startswith(f"{what}, ")]
    labels = list(dict.fromkeys(r["what"].removeprefix(f"{what}, ") for r in found))
    cases = {r["case"]: value(r["reference"]) for r in found}
    lines = [[case, reference, *(ours(r) for r in found if r["case"] == case)] for case, reference in cases.items()]
    return _table(["wind speed", "measured", *labels], lines)


def notebooks() -> str:
    """Gallery of the notebooks."""
    from pathlib import Path
    from runpy import run_path

    made: str = run_path(str(Path(__file__).with_name("notebooks.py")))["gallery"]()
    return made


MAKERS: dict[str, Any] = {
    f.__name__: f
    for f in (
        record,
        names,
        events,
        channels,
        openfast_channels,
        openfast_only,
        openfast_units,
        wind_formats,
        result_formats,
        keywords,
        array,
        arrays,
        load_cases,
        measured,
        notebooks,
        schemes,
        controllers,
        swap,
        supervisor,
    )
}
