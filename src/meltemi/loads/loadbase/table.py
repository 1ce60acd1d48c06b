"""Tables of design load cases: records, the editions of IEC 61400-1, IEC 61400-3-1 and 3-2, and changes by the user.

Reference: docs/guide/load-case-tables.md.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import AfterValidator, BeforeValidator, Field, model_validator

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.record import Record
from meltemi.core.yamlfile import merged, read_mapping, validated
from meltemi.iec.models import MODELS
from meltemi.loads.loadbase.metocean import Level, Seas
from meltemi.loads.loadbase.ranges import SYMBOLS, counts, numbers
from meltemi.simulation.events import read_events

FOLDER = Path(__file__).parent / "tables"
EDITIONS = (3, 4)
"""Editions of IEC 61400-1 that are tables of the package."""
AT_SEA = {"61400-3-1": "support", "61400-3-2": "platform"}
"""Standards of turbines in the sea, and the part of the turbine that each requires; their tables extend edition 4."""
Standard = Literal["61400-1", "61400-3-1", "61400-3-2"]
ANY = {name: 10.0 + i for i, name in enumerate(SYMBOLS)}
"""Values with which a text is tested before those of the turbine are known."""

SENSED = ("EDC", "ECD", "EWSH", "EWSV")
"""Wind models with two senses."""
Situation = Literal["production", "start", "normal stop", "emergency stop", "idling", "locked"]
Characteristic = Literal["extrapolated", "mean", "upper half", "largest", "life"]
Kind = Literal["ultimate", "fatigue"]


def _text(value: Any) -> Any:
    """A number or a list of them, as text."""
    if isinstance(value, list | tuple):
        texts = [_text(each) for each in value]
        return ", ".join(texts) if all(isinstance(text, str) for text in texts) else value
    return f"{value:.12g}" if isinstance(value, int | float) and not isinstance(value, bool) else value


def _readable(text: str) -> str:
    # whether a range ascends depends on the values of the turbine: only its numbers are tested
    numbers(text.replace(" to ", ", ").replace(" by ", ", ") if " to " in text else text, ANY)
    return text


def _countable(text: str) -> str:
    counts(text, ANY)
    return text


def names_in(text: str | None) -> list[str]:
    """Names in a text, separated by commas."""
    return [name.strip() for name in (text or "").split(",") if name.strip()]


def _names_of(what: str, known: Iterable[str]) -> AfterValidator:
    """Validator of a text whose names must be known."""

    def check(text: str) -> str:
        for name in names_in(text) or [""]:
            if name not in known:
                raise ValueError(f"no {what} {name!r}; {did_you_mean(name, known)}")
        return text

    return AfterValidator(check)


def _senses(text: str) -> str:
    if not names_in(text) or {*names_in(text)} - {"+", "-"}:
        raise ValueError(f"expected '+', '-' or '+, -', found {text!r}")
    return text


Numbers = Annotated[str, BeforeValidator(_text), AfterValidator(_readable)]
"""Numbers as text (``loadbase.ranges``)."""
Counts = Annotated[str, BeforeValidator(_text), AfterValidator(_countable)]
Names = Annotated[str, BeforeValidator(_text)]


class Assumed(Record):
    """A record that names which of its values come from practice, not from the standard or two sources."""

    practice: tuple[str, ...] = ()
    """Keys whose values come from practice."""

    @model_validator(mode="after")
    def _known(self) -> Self:
        for name in self.practice:
            if name not in type(self).model_fields:
                raise ValueError(f"practice: there is no key {name!r}; {did_you_mean(name, type(self).model_fields)}")
        return self


class LoadCaseRow(Assumed):
    """A row of the table: one design load case, or one of its variants."""

    dlc: str = ""
    """Design load case; by default the name of the row."""
    title: str
    """Description."""
    situation: Situation
    """Operating situation."""
    wind: Annotated[Names, _names_of("wind model", MODELS)]
    """Wind models of IEC 61400-1, separated by commas."""
    steady: bool = False
    """Whether EWM is the steady wind instead of the turbulent one."""
    speeds: Numbers | None = None
    """Mean wind speeds [m/s]; EWM has that of the class."""
    yaw: Numbers | None = None
    """Yaw errors [deg] of the wind against the rotor axis, clockwise from above; 0 by default."""
    yaw_steady: Numbers | None = None
    """Yaw errors [deg] with the steady wind of EWM."""
    yaw_weights: Numbers | None = None
    """Share of time of each yaw error; equal by default."""
    senses: Annotated[Names, AfterValidator(_senses)] | None = None
    """Senses of a direction change or shear: '+, -'."""
    azimuths: Numbers | None = None
    """Azimuths [deg] of blade 1, of a locked rotor, or by which a gust or event comes later in a revolution."""
    instants: Numbers | None = None
    """Times [s] of the event from the beginning of the gust; at a start, of the gust from the beginning of the run."""
    faults: Names | None = None
    """Faults: names, separated by commas."""
    sea: Seas | None = None
    """Sea: expected waves of the wind speed ("normal"), joint distribution of waves ("joint", for fatigue), severe sea,
    or extreme sea of 1 or 50 years; none on land."""
    misalignment: Numbers | None = None
    """Directions [deg] of the waves from that of the wind, clockwise from above; 0 by default; "joint" has the
    misalignments of the site."""
    levels: Annotated[Names, _names_of("level", get_args(Level))] | None = None
    """Levels of still water: mean (default), low, high: the range of the site, or of its extreme sea."""
    wave: float | None = Field(default=None, gt=0.0, lt=5.0)
    """Height of an embedded wave, crest to trough, over the significant wave height; none by default."""
    seeds: Counts | None = None
    """Number of turbulence seeds, also '6, 15 from V_r - 2'; from ``defaults`` if not given."""
    duration: float | None = Field(default=None, gt=0.0)
    """Evaluated duration [s]; from ``defaults`` if not given."""
    transient: float | None = Field(default=None, ge=0.0)
    """Initial transient [s], not evaluated; from ``defaults`` if not given."""
    begin: float | None = Field(default=None, ge=0.0)
    """Time [s] of the gust or event after the transient; from ``defaults`` if not given."""
    type: Kind
    """Ultimate or fatigue loads."""
    factor: float = Field(gt=0.0)
    """Partial safety factor for loads."""
    factor_rare: float | None = Field(default=None, gt=0.0)
    """Partial safety factor for faults with a return period of 50 years; linear in the period from 10 years on."""
    characteristic: Characteristic
    """Rule of the characteristic value."""
    state: str | None = None
    """State of ``states`` whose share of the lifetime the cases represent; fatigue only."""
    occurrences: Numbers | None = None
    """Occurrences [1/year] at each speed; fatigue only."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.storms and self.speeds is not None:
            raise ValueError(f"speeds: {self.storms[0]} has the speed of its class; leave speeds out")
        if not self.storms and self.speeds is None:
            raise ValueError(f"speeds: missing; {self.wind} needs mean wind speeds such as 'V_in to V_out by 2, V_r'")
        if self.steady and not self.storms:
            raise ValueError(f"steady: only EWM1 and EWM50 have both forms, not {self.wind}")
        if (self.type == "fatigue") != (self.characteristic == "life"):
            raise ValueError(f"characteristic: {self.characteristic} does not belong to type {self.type}")
        if (self.type == "fatigue") != ((self.state is None) != (self.occurrences is None)):
            if self.type == "ultimate":
                raise ValueError("state and occurrences belong to type fatigue")
            raise ValueError("type fatigue needs either state or occurrences")
        if self.senses is not None and {*names_in(self.wind)} - {*SENSED}:
            raise ValueError(f"senses: only {', '.join(SENSED)} have two, not {self.wind}")
        if self.sea == "joint" and (self.type != "fatigue" or self.misalignment or self.levels or self.wave):
            raise ValueError("sea: joint is for type fatigue, and the site has its misalignments; no levels, no wave")
        if self.sea is None and (self.misalignment or self.levels or self.wave):
            raise ValueError("misalignment, levels and wave need a sea: normal, severe, 1-year, 50-year")
        if self.situation == "start" and self.faults is not None:
            raise ValueError("faults: situation start has none")
        return self

    @property
    def storms(self) -> list[str]:
        """Extreme wind speed models of the row."""
        return [name for name in names_in(self.wind) if name.startswith("EWM")]


class Fault(Assumed):
    """A fault: events of a case, with times after the instant of the fault."""

    title: str
    """Description."""
    events: tuple[dict[str, Any], ...] = Field(min_length=1)
    """Events as in a case file, with ``after`` [s] (0 by default) and ``lasts`` [s] instead of ``at`` and ``until``;
    ``blade: all`` is one event for each blade; a ``rate`` may be ``emergency_rate`` or ``normal_rate`` of the campaign,
    or minus that."""
    electrical: bool = False
    """Whether it needs an electrical system."""
    return_period: float | None = Field(default=None, gt=0.0)
    """Return period [years], for rows with ``factor_rare``."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        try:
            self.at(0.0)
        except InputError as error:
            raise ValueError(str(error)) from None
        return self

    def at(
        self, instant: float, blades: int = 3, normal_rate: float = 0.1, emergency_rate: float = 0.1
    ) -> list[dict[str, Any]]:
        """Events of a case file for a fault at ``instant`` [s]; number of blades and pitch rates [rad/s] of stops.

        Raises:
          InputError: there is no such event.
        """
        events: list[dict[str, Any]] = []
        rates = {"normal_rate": normal_rate, "emergency_rate": emergency_rate}
        rates |= {f"-{name}": -value for name, value in rates.items()}
        for event in self.events:
            begin = round(instant + _seconds(event, "after"), 6)
            given = {key: value for key, value in event.items() if key not in ("after", "lasts")} | {"at": begin}
            if "lasts" in event:
                given["until"] = round(begin + _seconds(event, "lasts"), 6)
            if isinstance(given.get("rate"), str) and given["rate"] in rates:
                given["rate"] = rates[given["rate"]]
            every = range(1, blades + 1) if given.get("blade") == "all" else [given.get("blade")]
            events += [given | {"blade": blade} if blade else given for blade in every]
        read_events(events)
        return events


def _seconds(event: Mapping[str, Any], key: str) -> float:
    value = event.get(key, 0.0)
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e9:
        raise InputError(f"events: {key}: expected a number of seconds, found {value!r}")
    return float(value)


class State(Assumed):
    """A state of the turbine and its share of the lifetime, for the weights of fatigue."""

    inside: float | None = Field(default=None, ge=0.0, le=1.0)
    """Share of the time with wind between cut-in and cut-out."""
    outside: float = Field(default=0.0, ge=0.0, le=1.0)
    """Share of the time with other wind."""
    hours: float | None = Field(default=None, ge=0.0, le=8766.0)
    """Hours [h/year] with wind between cut-in and cut-out. A state without ``inside`` and ``hours`` has the rest."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if self.inside is not None and self.hours is not None:
            raise ValueError("give either inside or hours")
        return self


class Defaults(Assumed):
    """Defaults of values that rows leave out; a campaign may change them."""

    duration: float = Field(default=600.0, gt=0.0)
    """Evaluated duration [s] of a case."""
    transient: float = Field(default=60.0, ge=0.0)
    """Initial transient [s], not evaluated."""
    begin: float = Field(default=10.0, ge=0.0)
    """Time [s] of a gust or event after the transient."""
    seeds: int = Field(default=6, ge=1, le=1000)
    """Number of turbulence seeds."""
    yaw_error: float = Field(default=8.0, ge=0.0, le=180.0)
    """The usual yaw error [deg]."""
    v_maint: float = Field(default=18.0, gt=0.0, le=100.0)
    """V_maint [m/s]: largest wind speed for maintenance."""


class Factors(Assumed):
    """Safety factors beside those of the rows."""

    favourable: float = Field(default=0.9, gt=0.0)
    """Factor on favourable loads."""
    consequence_ultimate: tuple[float, float, float] = (0.9, 1.0, 1.2)
    """Factors gamma_n of component classes 1, 2, 3 for ultimate loads."""
    consequence_fatigue: tuple[float, float, float] = (0.9, 1.0, 1.2)
    """Factors gamma_n of component classes 1, 2, 3 for fatigue."""
    gravity: tuple[float, float] = (0.15, 0.25)
    """Factors phi of gravity loads in DLC 1.1 and in other cases: gamma_f = 1.1 + phi (1 - abs(F_gravity / F_k))^2."""
    clearance: float = Field(default=0.3, ge=0.0, lt=1.0)
    """Least tip clearance over that of the undeflected rotor."""
    line_mean: tuple[float, float] = (1.3, 1.0)
    """Factors on the mean tension of mooring lines, with all lines and after the loss of one."""
    line_dynamic: tuple[float, float] = (1.75, 1.1)
    """Factors on the dynamic tension, the part above the mean."""


class ExtrapolationRule(Assumed):
    """Rule for the extrapolation of DLC 1.1."""

    probability: float = Field(default=3.8e-7, gt=0.0, lt=1.0)
    """Probability that the load of 50 years is exceeded in 10 minutes."""
    quantiles: tuple[tuple[float, float], ...] = ()
    """Factors and quantiles of the 10-minute extremes, in place of an extrapolation."""


class LoadTable(Record):
    """A table of design load cases."""

    edition: Literal[3, 4]
    """Edition of IEC 61400-1."""
    title: str
    source: str
    """Source of the values."""
    defaults: Defaults = Defaults()
    states: dict[str, State] = Field(default_factory=dict)
    factors: Factors = Factors()
    extrapolation: ExtrapolationRule = ExtrapolationRule()
    rows: dict[str, LoadCaseRow]
    """Design load cases by name."""
    faults: dict[str, Fault] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not self.rows:
            raise ValueError("rows: the table has none")
        for name, row in self.rows.items():
            if not name.replace(".", "").replace("_", "").isalnum():
                raise ValueError(f"rows: the name {name!r} may have letters, digits, '.' and '_' only")
            for fault in names_in(row.faults):
                if fault not in self.faults:
                    raise ValueError(f"rows.{name}.faults: no fault {fault!r}; {did_you_mean(fault, self.faults)}")
            if row.state is not None and row.state not in self.states:
                raise ValueError(f"rows.{name}.state: no state {row.state!r}; {did_you_mean(row.state, self.states)}")
        for state in self.states:
            if len(rows := [name for name, row in self.rows.items() if row.state == state]) > 1:
                raise ValueError(f"rows {' and '.join(rows)} have state {state!r}, whose time would count twice")
        return self

    def dlc(self, name: str) -> str:
        """Design load case of a row."""
        return self.rows[name].dlc or name

    def assumptions(self) -> list[tuple[str, Assumed, str]]:
        """Values that come from practice: row or part, its record, and key."""
        parts: dict[str, Assumed] = {"defaults": self.defaults, "factors": self.factors}
        parts |= {f"state {name}": state for name, state in self.states.items()}
        parts |= {f"DLC {name}": row for name, row in self.rows.items()}
        used = {fault for row in self.rows.values() for fault in names_in(row.faults)}
        parts |= {f"fault {name.replace('_', ' ')}": fault for name, fault in self.faults.items() if name in used}
        return [
            (part, record, key)
            for part, record in parts.items()
            for key in record.practice
            if getattr(record, key) is not None
        ]


@cache
def edition_content(edition: int | str) -> dict[str, Any]:
    """Content of the table of an edition of IEC 61400-1, or of "61400-3-1" or "61400-3-2".

    Raises:
      InputError: the package has no table of this edition.
    """
    if edition not in (*EDITIONS, *AT_SEA):
        raise InputError(f"edition of IEC 61400-1: expected {' or '.join(map(str, EDITIONS))}, found {edition!r}")
    path = FOLDER / (f"iec{edition}.yaml" if edition in AT_SEA else f"iec61400-1-ed{edition}.yaml")
    data = read_mapping(path)
    base = data.pop("extends", None)
    content = data if base is None else changed(edition_content(base), data, str(path))
    return content | {
        "rows": dict(sorted(content["rows"].items(), key=lambda row: (float(row[0].rstrip("b")), row[0])))
    }


def changed(table: Mapping[str, Any], changes: Mapping[str, Any], where: str) -> dict[str, Any]:
    """Content of a table with changes, which name only the differences.

    Rows and faults are changed by name; ``without`` lists rows to leave out. A row with a new name is added; ``like``
    names a row that it takes everything else from.

    Raises:
      InputError: ``without`` or ``like`` names a row that is not there, or a row is new and incomplete.
    """
    if not isinstance(changes, Mapping):
        raise InputError(f"{where}: expected keys and values, found {changes!r}")
    changes = dict(changes)
    for part in ("rows", "faults", "states"):
        if part in changes:
            if not isinstance(changes[part], Mapping):
                raise InputError(f"{where}: {part}: expected names with keys and values, found {changes[part]!r}")
            changes[part] = {str(name): value for name, value in changes[part].items()}
    known = table["rows"]
    given = changes.pop("without", None) or []
    if not isinstance(given, list | tuple):
        raise InputError(f"{where}: without: expected a list of rows, found {given!r}; write [{given}]")
    without = [str(name) for name in given]
    for name in without:
        if name not in known:
            raise InputError(f"{where}: without: no row {name!r}; {did_you_mean(name, known)}")
    rows = {}
    for name, row in changes.get("rows", {}).items():
        if not isinstance(row, Mapping):
            raise InputError(f"{where}: rows.{name}: expected keys and values, found {row!r}")
        row = dict(row)
        like = row.pop("like", None)
        if like is not None:
            if str(like) not in known:
                raise InputError(f"{where}: rows.{name}.like: no row {str(like)!r}; {did_you_mean(str(like), known)}")
            if name in known:
                raise InputError(f"{where}: rows.{name}.like: the table has this row already; like is for new rows")
            row = dict(known[str(like)]) | row
        elif name not in known and (
            missing := [key for key, f in LoadCaseRow.model_fields.items() if f.is_required() and key not in row]
        ):
            raise InputError(
                f"{where}: rows.{name}: the table has no such row; {did_you_mean(name, known)} "
                f"(a new row needs {', '.join(missing)}, or like)"
            )
        rows[name] = row
    content = merged(table, changes | ({"rows": rows} if rows else {}))
    content["rows"] = {
        name: {key: value for key, value in row.items() if value is not None}
        for name, row in content["rows"].items()
        if name not in without
    }
    return content


def load_table(
    edition: int | str = 4, changes: Mapping[str, Any] | None = None, where: str = "table", text: str | None = None
) -> LoadTable:
    """Table of an edition of IEC 61400-1, or that of IEC 61400-3-1 or 3-2, with changes.

    Args:
      edition: 3 or 4; or "61400-3-1", "61400-3-2".
      changes: changes as in a file of changes (docs/guide/load-case-tables.md).
      where: source that messages name.
      text: text of the file of changes, for the line numbers of messages.

    Raises:
      InputError: no such edition; a change names something that is not there, or has a value that is not allowed.
    """
    content = edition_content(edition)
    return validated(changed(content, changes, where) if changes else content, LoadTable, where, text)
