"""Design variables: numbers and tables of a turbine, and entries of a controller's state, as one vector.

Reference: docs/theory/designs.md (D-1, D-2).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.control.baseline import BaselineState
from meltemi.core.errors import InputError, MeltemiError, did_you_mean
from meltemi.core.record import COPY
from meltemi.designs.layup import DesignLayup
from meltemi.designs.settings import VariableSetting
from meltemi.designs.splines import spline_rows
from meltemi.designs.tower import WALLS, put_walls
from meltemi.sections.layup import Layup
from meltemi.turbine.definition import Turbine
from meltemi.turbine.power_turbine import AnyTurbine

Float = NDArray[np.float64]
ALIASES = {"minimum_pitch": "pitch.minimum", "maximum_pitch": "pitch.maximum", "pitch_rate": "pitch.rate_limit"}
ALIASES |= {"torque_rate": "torque.rate_limit"}
"""Parameters of the baseline controller whose names in the turbine's file differ."""


@dataclass(frozen=True)
class Variable:
    """One number of a design.

    Attributes:
      name: path, and the number of the control point or entry.
      path: keys in the turbine's description, or the entry of the controller's state.
      low, high, start: bounds and value at the start.
      scale: change that counts as one in the search.
      row: (S,) effect of the variable on the entries of a list; empty for a number.
      add: whether it is added to the entries, instead of multiplied.
      unit: value of the number at the start, if the variable is a factor on it; else 1.
    """

    name: str
    path: str
    low: float
    high: float
    start: float
    scale: float
    add: bool = False
    unit: float = 1.0
    row: Float = field(default_factory=lambda: np.zeros(0), repr=False)

    @property
    def of_controller(self) -> bool:
        """Whether it is an entry of the controller's state."""
        return self.path.startswith("controller.")

    @property
    def of_layup(self) -> bool:
        """Whether it is a factor on the thickness of layers of the blade."""
        return self.path.startswith("layup.")

    @property
    def of_law(self) -> bool:
        """Whether it acts by the controller alone: by its state, or by the turbine's settings of the control."""
        return self.path.startswith(("controller.", "control."))


@dataclass(frozen=True)
class Variables:
    """The variables of a design, the turbine at its start, and the layup of its blade, if sections follow from it."""

    turbine: AnyTurbine
    each: tuple[Variable, ...]
    layup: DesignLayup | None = None

    @cached_property
    def low(self) -> Float:
        """(P,) lower bounds."""
        return np.array([v.low for v in self.each])

    @cached_property
    def high(self) -> Float:
        """(P,) upper bounds."""
        return np.array([v.high for v in self.each])

    @cached_property
    def start(self) -> Float:
        """(P,) values at the start."""
        return np.array([v.start for v in self.each])

    @cached_property
    def scale(self) -> Float:
        """(P,) changes that count as one."""
        return np.array([v.scale for v in self.each])

    @property
    def names(self) -> list[str]:
        """Names of the variables."""
        return [v.name for v in self.each]

    def apply(self, x: Sequence[float] | Float, about: Float | None = None) -> AnyTurbine:
        """The turbine of a design (D-1).

        Args:
          x: (P,) values of the variables.
          about: values about which the sections of a layup are expanded, for derivatives there (D-19); else they are
            computed.

        Raises:
          InputError: the description is not valid, or a section cannot be computed.
        """
        turbine = self._described(x)
        if self.layup is None:
            return turbine
        assert isinstance(turbine, Turbine)
        base = None if about is None else self.layup_at(about)
        return self.layup.blade(turbine, self.layup_at(x, turbine), base)

    def layup_at(self, x: Sequence[float] | Float, turbine: Turbine | None = None) -> Layup:
        """The layup of the blade of a design."""
        assert self.layup is not None
        factors: dict[str, list[float]] = {}
        for v, value in zip(self.each, x, strict=True):
            if v.of_layup:
                factors.setdefault(v.path.removeprefix("layup."), []).append(float(value))
        described = self._described(x) if turbine is None else turbine
        assert isinstance(described, Turbine)
        return self.layup.changed(described, factors)

    def _described(self, x: Sequence[float] | Float) -> AnyTurbine:
        """The turbine of a design without its layup."""
        if all(v.of_controller or v.of_layup for v in self.each):
            return self.turbine
        data = self.turbine.model_dump(mode="python", context=COPY)
        lists: dict[str, tuple[Float, Float]] = {}
        for v, value in zip(self.each, x, strict=True):
            if v.of_controller or v.of_layup:
                continue
            if not v.row.size:
                put(data, v.path, v.unit * float(value))
                continue
            factor, offset = lists.setdefault(v.path, (np.ones(len(v.row)), np.zeros(len(v.row))))
            (offset if v.add else factor)[...] += (value - (0.0 if v.add else 1.0)) * v.row
        walls = {path: lists.pop(path)[0] for path in WALLS if path in lists}
        if walls:
            put_walls(data["tower"], walls)
        for path, (factor, offset) in lists.items():
            for container, key in places(data, path):
                value = np.asarray(container[key], dtype=float) * factor + offset
                container[key] = value.tolist() if isinstance(container[key], list | tuple) else float(value[0])
        try:
            return type(self.turbine).model_validate(data)
        except (ValueError, MeltemiError) as error:
            raise InputError(f"the design is no valid turbine: {error}") from None

    def entries(self, x: Sequence[float] | Float) -> dict[str, float]:
        """Values of the entries of the controller's state."""
        return {v.path: v.unit * float(value) for v, value in zip(self.each, x, strict=True) if v.of_controller}


def places(data: Any, path: str, name: str = "") -> Iterator[tuple[Any, Any]]:
    """Containers and keys of a path in nested dictionaries and lists; ``*`` stands for all keys.

    Raises:
      InputError: a key is unknown.
    """
    first, _, rest = path.partition(".")
    name = name or f"turbine.{path}"
    if isinstance(data, list | tuple):
        known: list[Any] = [*range(len(data))]
        keys = known if first == "*" else [int(first) - 1] if first.isdigit() and 1 <= int(first) <= len(data) else []
        shown = [str(i + 1) for i in known]
    else:
        known = list(data) if isinstance(data, Mapping) else []
        keys = known if first == "*" else [first] if first in known else []
        shown = list(map(str, known))
    if not keys:
        raise InputError(f"variables: {name!r} leads nowhere at {first!r}: {did_you_mean(first, shown)}")
    for key in keys:
        if rest:
            yield from places(data[key], rest, name)
        else:
            yield data, key


def put(data: Any, path: str, value: float) -> None:
    """Set a number in nested dictionaries."""
    for container, key in places(data, path):
        container[key] = value


def variables_of(
    settings: Mapping[str, VariableSetting], turbine: AnyTurbine, state: Mapping[str, float],
    layup: DesignLayup | None = None,
) -> Variables:  # fmt: skip
    """The variables of a design.

    Args:
      settings: by path.
      turbine: the turbine at the start.
      state: state of the controller at the start by the names of its entries; those of the baseline controller are
        numbers of the turbine's description instead.
      layup: of the blade.

    Raises:
      InputError: a path is unknown, or leads to no number.
    """
    found: list[Variable] = []
    for name, setting in settings.items():
        kind, _, rest = name.partition(".")
        if kind == "layup" and rest:
            if layup is None:
                raise InputError(f"variables: {name!r} needs a layup: add layup: {{file: ...}}, a windIO or layup file")
            found += _of_layup(name, setting)
        elif kind == "turbine" and rest:
            found += _of_turbine(name, rest, setting, turbine)
        elif name in WALLS and isinstance(turbine, Turbine):
            if setting.add:
                raise InputError(f"variables: {name!r} is a factor: leave add out")
            found += [replace(v, path=name) for v in _of_turbine(name, "tower.diameter", setting, turbine)]
        elif kind == "controller" and rest:
            if rest not in state:
                raise InputError(f"variables: the controller has no {name!r}: {did_you_mean(rest, state)}")
            own = _in_turbine(rest, turbine) if set(state) == set(BaselineState.names) else ""
            found += _of_turbine(name, own, setting, turbine) if own else [_number(name, name, setting, state[rest])]
        else:
            hint = did_you_mean(name, [*WALLS, *(f"controller.{entry}" for entry in state)])
            raise InputError(f"variables: {name!r} is no controller.NAME, turbine.PATH or layup.LAYER: {hint}")
    return Variables(turbine, tuple(found), layup)


def _of_layup(name: str, s: VariableSetting) -> list[Variable]:
    if s.add or s.entry:
        raise InputError(f"variables: {name!r} is a factor on thickness: entry and add are for lists of the turbine")
    names = [name] if s.knots is None else [f"{name}[{k + 1}/{s.knots}]" for k in range(s.knots)]
    one = _number(name, name, s.replace(relative=True), 1.0)
    return [replace(one, name=each) for each in names]


def _in_turbine(name: str, turbine: AnyTurbine) -> str:
    """Path of a parameter of the baseline controller in the turbine's description; empty for a state."""
    control = turbine.control
    for path in (ALIASES.get(name, ""), name, f"torque.{name}", f"pitch.{name}"):
        part, _, key = path.rpartition(".")
        holder = getattr(control, part) if part else control
        if key and isinstance(getattr(holder, key, None), float):
            return f"control.{path}"
    return ""


def _of_turbine(name: str, path: str, s: VariableSetting, turbine: AnyTurbine) -> list[Variable]:
    data = turbine.model_dump(mode="python", context=COPY)
    targets = [(container, container[key]) for container, key in places(data, path, name)]
    lists = [np.asarray(value) for _, value in targets if isinstance(value, list | tuple)]
    if not lists:
        values = [value for _, value in targets]
        if any(isinstance(value, bool) or not isinstance(value, int | float) for value in values):
            raise InputError(f"variables: {name!r} is neither a number nor a list of numbers")
        value = values[0]
        if s.knots or s.entry or s.add:
            raise InputError(f"variables: {name!r} is a number: knots, entry and add are for lists")
        if len(values) > 1:  # a factor on all of them
            common = _number(name, path, s.replace(relative=True), 1.0)
            return [replace(common, row=np.ones(1))]
        return [_number(name, path, s, float(value))]
    if len(lists) < len(targets) or any(a.dtype.kind not in "if" for a in lists):
        raise InputError(f"variables: {name!r} is neither a number nor a list of numbers")
    unlike = len({len(a) for a in lists}) > 1 or lists[0].ndim > 1
    if unlike and (s.knots or s.entry or s.add):
        raise InputError(f"variables: {name!r}: knots, entry and add need lists of one length")
    base = 0.0 if s.add else 1.0
    start = base if s.start is None else float(s.start)
    n = len(lists[0])
    along = targets[0][0].get("position") if isinstance(targets[0][0], dict) else None
    span = np.asarray(along if along is not None and len(along) == n else np.arange(n), dtype=float)
    span = (span - span[0]) / (span[-1] - span[0]) if n > 1 else span
    if s.entry is not None:
        if s.entry > n:
            raise InputError(f"variables: {name!r} has {n} entries, and entry {s.entry} is asked for")
        rows, names = np.eye(n)[s.entry - 1 : s.entry], [f"{name}[{s.entry}]"]
    elif s.knots is not None:
        rows = spline_rows(span, s.knots)
        names = [f"{name}[{k + 1}/{s.knots}]" for k in range(s.knots)]
    else:
        rows, names = np.ones((1, n)), [name]
    low, high = float(s.low), float(s.high)
    if not low <= start <= high:
        raise InputError(f"variables: {name!r} begins at {start:g}, outside low {low:g} to high {high:g}")
    if unlike:
        rows = np.ones((1, 1))
    scale = s.scale or 0.25 * (high - low)
    return [Variable(one, path, low, high, start, scale, s.add, 1.0, row) for one, row in zip(names, rows, strict=True)]


def _number(name: str, path: str, s: VariableSetting, value: float) -> Variable:
    base = 1.0 if s.relative else value
    start = base if s.start is None else float(s.start)
    low, high = float(s.low), float(s.high)
    if not low <= start <= high:
        raise InputError(f"variables: {name!r} begins at {start:g}, outside low {low:g} to high {high:g}")
    return Variable(name, path, low, high, start, s.scale or 0.25 * (high - low), unit=value if s.relative else 1.0)
