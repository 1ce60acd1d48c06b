"""The file of a design: variables, objective, constraints and cases (docs/guide/designs.md)."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, field_validator, model_validator

from meltemi.core.record import Record
from meltemi.core.units import angular_unit, from_text


class VariableSetting(Record):
    """A number that the optimiser chooses, or with ``knots`` several."""

    low: float | str
    """Smallest value: of a number its own, or with ``relative`` a factor on it; of a list a factor on all entries."""
    high: float | str
    """Largest value."""
    start: float | str | None = None
    """Value at the start, by default that of the turbine."""
    relative: bool = False
    """Bounds of a number are factors on its value at the start."""
    add: bool = False
    """An offset that is added to a list, in its unit, instead of a factor; angles with a unit: ``-3 deg``."""
    knots: int | None = Field(default=None, ge=2, le=50)
    """Number of control points of a factor or offset that varies along the list's stations, by a natural cubic spline
    [-; 2 to 12]."""
    entry: int | None = Field(default=None, ge=1)
    """Only this entry of the list, from 1."""
    scale: float | None = Field(default=None, gt=0.0)
    """Change of the variable that counts as one in the search; by default a quarter of the range between its bounds."""

    @field_validator("low", "high", "start")
    @classmethod
    def _number(cls, value: Any) -> Any:
        return from_text(value, angular_unit("[rad]") or "rad") if isinstance(value, str) else value

    @model_validator(mode="after")
    def _check(self) -> VariableSetting:
        if isinstance(self.low, str) or isinstance(self.high, str) or isinstance(self.start, str):
            raise ValueError("low, high and start must be numbers, or angles with a unit such as -3 deg")
        if not self.low < self.high:
            raise ValueError(f"low {self.low:g} must be less than high {self.high:g}: no value lies between the bounds")
        if self.start is not None and not self.low <= self.start <= self.high:
            raise ValueError(f"start {self.start:g} lies outside low {self.low:g} to high {self.high:g}")
        if self.knots and self.entry:
            raise ValueError("give either knots or entry")
        return self


class LayupSetting(Record):
    """Layup from which stiffness, mass and twist of the blade's sections are computed."""

    file: str
    """windIO file or layup file, or a turbine of the library with a layup."""
    model: Literal["walls", "elements"] = "walls"
    """Thin walls, or finite elements."""
    stations: int | None = Field(default=None, ge=5, le=500)
    """Evenly spaced stations; by default those of the turbine's blade [-; 20 to 80]."""


class TermSetting(Record):
    """A share of the objective."""

    weight: float = 1.0
    """Share of the term, over its value at the start; negative to increase it [-; 0.001 to 100]."""
    slope: float | None = Field(default=None, ge=1.0, le=20.0)
    """``del``: slope m of the S-N curve; 10 for blades, 3 for mooring lines, 4 for others [-; 3 to 14]."""
    sharpness: float = Field(default=200.0, gt=0.0)
    """``max``, ``min``, ``clearance``: sharpness of the soft maximum [-; 20 to 2000]."""


class ConstraintSetting(TermSetting):
    """Limits of a term."""

    most: float | None = None
    """Largest ratio to the value at the start [-; 0.1 to 10]."""
    least: float | None = None
    """Smallest ratio to the value at the start [-; 0.1 to 10]."""
    below: float | None = None
    """Largest value in SI units, of frequencies in Hz."""
    above: float | None = None
    """Smallest value in SI units, of frequencies in Hz."""
    away: float | None = Field(default=None, ge=0.0, lt=0.5)
    """``frequency``: margin to the bands of once and three times the rotor's speed [-; 0.02 to 0.2]."""

    @model_validator(mode="after")
    def _check(self) -> ConstraintSetting:
        given = [self.most, self.least, self.below, self.above, self.away]
        if all(each is None for each in given):
            raise ValueError("a constraint needs one of most, least (ratios to the start), below, above (SI), away")
        for low, high, names in (
            (self.least, self.most, "least and most"),
            (self.above, self.below, "above and below"),
        ):
            if low is not None and high is not None and low > high:
                raise ValueError(f"{names} contradict each other: no value is above {low:g} and below {high:g}")
        return self


class CaseSetting(Record):
    """Runs of the objective that differ in their seeds."""

    speed: float | None = Field(default=None, gt=0.0)
    """[m/s; 3 to 30] wind speed, in place of ``wind.speed``."""
    seeds: tuple[int, ...] = (1,)
    """Seeds of the turbulence: the same in all iterations."""
    weight: float = Field(default=1.0, gt=0.0)
    """Weight of these runs together [-; 0.001 to 1000]."""
    wind: dict[str, Any] = Field(default_factory=dict)
    """Keys of the wind of these runs, besides those of ``case``."""
    sea: dict[str, Any] | None = None
    """Sea of these runs."""
    other: dict[str, Any] = Field(default_factory=dict)
    """Any further keys of a case file."""

    @field_validator("seeds")
    @classmethod
    def _some(cls, seeds: tuple[int, ...]) -> tuple[int, ...]:
        if not seeds or len(set(seeds)) < len(seeds):
            raise ValueError("seeds must be at least one number, each once")
        return seeds


class BaseSetting(Record):
    """Runs from the plan of a load base."""

    file: str
    """File of the load base (``meltemi loads``)."""
    dlc: tuple[str, ...] = ("1.2",)
    """Design load cases."""
    most: int = Field(default=200, ge=1)
    """Largest number of cases; more are an error."""


class ProofSetting(Record):
    """Runs that the optimiser does not see, for the comparison of start and end."""

    seeds: tuple[int, ...] = ()
    """Seeds; by default six beyond those of the cases."""
    cases: tuple[CaseSetting, ...] = ()
    """Other cases; by default those of the objective."""


class Design(Record):
    """A design by gradients."""

    turbine: str
    """Name in the library or path of a YAML file."""
    variables: dict[str, VariableSetting] = Field(min_length=1)
    """What the optimiser may change, by paths: ``controller.NAME``, ``turbine.PATH`` or ``layup.LAYER``."""
    layup: LayupSetting | None = None
    """Layup of the blade, whose layers' thickness may be variables."""
    objective: dict[str, float | TermSetting] = Field(min_length=1)
    """Terms and their shares: ``del TwrBsMyt: 0.5``."""
    constraints: dict[str, ConstraintSetting] = Field(default_factory=dict)
    """Terms and their limits: ``mean generator_power: {least: 0.99}``."""
    case: dict[str, Any] = Field(default_factory=dict)
    """Keys of a case file that all cases share: wind, controller, duration, transient, options and so on."""
    cases: tuple[CaseSetting, ...] = ()
    """Runs of the objective."""
    base: BaseSetting | None = None
    """Runs of the objective, from a load base."""
    proof: ProofSetting = ProofSetting()
    method: Literal["slsqp", "trust-constr", "l-bfgs-b", "ipopt"] = "slsqp"
    """Optimiser: of SciPy, or Ipopt (extra ``ipopt``). ``l-bfgs-b`` takes bounds only."""
    iterations: int = Field(default=30, ge=1, le=1000)
    """Largest number of iterations [-; 5 to 100]."""
    tolerance: float = Field(default=1e-4, gt=0.0, lt=1.0)
    """Change of the objective at which the search ends [-; 1e-5 to 0.01]."""

    @model_validator(mode="after")
    def _check(self) -> Design:
        if bool(self.cases) == (self.base is not None):
            raise ValueError("give either cases or base: the runs over which the objective is computed")
        if self.method == "l-bfgs-b" and self.constraints:
            raise ValueError("method: l-bfgs-b takes bounds only; use slsqp, trust-constr or ipopt with constraints")
        return self
