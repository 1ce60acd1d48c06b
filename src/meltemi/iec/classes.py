"""Wind turbine classes of IEC 61400-1, and the standard deviations and extreme speeds that follow from them.

Three editions: 2 (1999), 3 (2005) and 4 (2019). The symbols are the standard's: V_ref, V_ave, I_ref (I_15 and a
in edition 2), sigma_1, Lambda_1, V_e50, V_e1.

Reference: docs/theory/iec.md; IEC 61400-1 ed. 3, clauses 6.2 and 6.3; what differs in editions 2 and 4.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal, Self, get_args

from pydantic import Field, model_validator

from meltemi.core.errors import InputError, UnsupportedError, did_you_mean
from meltemi.core.record import Record

Edition = Literal[2, 3, 4]
EDITIONS: tuple[Edition, ...] = get_args(Edition)

V_REF: dict[Edition, dict[str, float]] = {
    2: {"I": 50.0, "II": 42.5, "III": 37.5, "IV": 30.0},
    3: {"I": 50.0, "II": 42.5, "III": 37.5},
    4: {"I": 50.0, "II": 42.5, "III": 37.5},
}
"""[m/s] reference speed of each class: clause 6.2, table 1."""
I_REF: dict[Edition, dict[str, float]] = {
    2: {"A": 0.18, "B": 0.16},
    3: {"A": 0.16, "B": 0.14, "C": 0.12},
    4: {"A+": 0.18, "A": 0.16, "B": 0.14, "C": 0.12},
}
"""Turbulence intensity of each category at 15 m/s [-]: clause 6.2, table 1. The characteristic value I_15 in edition 2,
the expected one I_ref since edition 3."""
SLOPE = {"A": 2.0, "B": 3.0}
"""Slope parameter a of edition 2 [-]: clause 6.2, table 1."""
V_REF_TROPICAL = 57.0
"""[m/s] V_ref,T of edition 4, clause 6.2, table 1: where there are tropical cyclones, whatever the class."""

NTM_B, ETM_C = 5.6, 2.0
"""[m/s] b and c of the normal and the extreme turbulence model since edition 3."""
GUST_FACTOR, ONE_YEAR = 1.4, 0.8
"""V_e50 / V_ref, a 3 s gust over the 10 min mean, and speeds of 1 year over those of 50 years [-]."""
STORM_INTENSITY = 0.11
"""Ratio sigma_1 / V_hub of the turbulent extreme wind speed model [-]: ed. 3, eq. 16."""


class WindClass(Record):
    """A wind turbine class. :func:`wind_class` returns those of the standard; class S has user-defined values."""

    name: str
    """Name, e.g. ``IIB``."""
    edition: Edition = 3
    """Edition of IEC 61400-1."""
    v_ref: float = Field(gt=0.0, le=70.0)
    """V_ref [m/s]: 10 min mean of 50 years at hub height."""
    v_ave: float = Field(gt=0.0, le=50.0)
    """V_ave [m/s]: annual mean at hub height; 0.2 V_ref by default."""
    v_storm: float = Field(gt=0.0, le=70.0)
    """[m/s] wind speed instead of V_ref in the extreme wind speed model: V_ref,T of edition 4; V_ref by default."""
    i_ref: float = Field(gt=0.0, lt=1.0)
    """I_ref [-]: expected turbulence intensity at 15 m/s; in edition 2 I_15, the characteristic one."""
    a: float | None = Field(default=None, gt=0.0)
    """Slope parameter of edition 2 [-]; there is none in the others."""

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            name: str,
            v_ref: float,
            i_ref: float,
            edition: Edition = 3,
            v_ave: float = ...,
            v_storm: float = ...,
            a: float | None = None,
        ) -> None: ...

    @model_validator(mode="before")
    @classmethod
    def _fill(cls, data: Any) -> Any:
        if not isinstance(data, dict) or not isinstance(v_ref := data.get("v_ref"), int | float):
            return data
        return {"v_ave": 0.2 * v_ref, "v_storm": v_ref} | data

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.a is None) == (self.edition == 2):
            raise ValueError("a is needed in edition 2" if self.a is None else "a belongs to edition 2")
        return self

    @property
    def label(self) -> str:
        """Short description, for titles and metadata."""
        return f"class {self.name}, edition {self.edition}"


def _standard_classes(edition: Edition) -> dict[str, WindClass]:
    classes: dict[str, WindClass] = {}
    for roman, v_ref in V_REF[edition].items():
        for category, i_ref in I_REF[edition].items():
            a = SLOPE[category] if edition == 2 else None
            name = roman + category
            classes[name] = WindClass(name=name, edition=edition, v_ref=v_ref, i_ref=i_ref, a=a)
            if edition == 4:
                classes[name + "T"] = classes[name].replace(name=name + "T", v_storm=V_REF_TROPICAL)
    return classes


CLASSES: dict[Edition, dict[str, WindClass]] = {edition: _standard_classes(edition) for edition in EDITIONS}
"""The standard's classes by edition and name. In edition 4 an appended T means tropical cyclones."""


def wind_class(name: str, edition: Edition = 3) -> WindClass:
    """Wind turbine class of the standard by its name.

    Args:
      name: class and turbulence category: ``IA`` to ``IIIC``; edition 2 has ``IVA`` and ``IVB``, too, but no C;
        edition 4 has A+ as well, and ``IIBT`` for areas with tropical cyclones.
      edition: edition of IEC 61400-1: 2, 3 or 4.

    Returns:
      The class, with its reference speed and turbulence.

    Raises:
      InputError: the class or edition does not exist.

    Source: IEC 61400-1, clause 6.2, table 1 of each edition.
    """
    if edition not in CLASSES:
        raise InputError(f"edition of IEC 61400-1: expected 2, 3 or 4, found {edition!r}")
    classes = CLASSES[edition]
    if name not in classes:
        hint = did_you_mean(str(name), classes)
        raise InputError(
            f"wind class: expected {', '.join(V_REF[edition])} followed by {', '.join(I_REF[edition])} "
            f"(edition {edition}), found {name!r}; {hint}"
        )
    return classes[name]


def as_class(of: str | WindClass, edition: Edition | None) -> WindClass:
    """A class given by name (edition 3 by default) or as a record, which has an edition."""
    if isinstance(of, WindClass):
        if edition not in (None, of.edition):
            raise InputError(f"edition: the {of.label} cannot be used with edition {edition}")
        return of
    return wind_class(of, 3 if edition is None else edition)


def positive_speed(model: str, speed: float) -> float:
    """Validate a wind speed at hub height."""
    if not 0.0 < speed <= 100.0:
        raise InputError(f"{model}: speed must be above 0 and at most 100 m/s, found {speed!r}")
    return float(speed)


def sigma_ntm(
    speed: float, wind_class: str | WindClass, *, edition: Edition | None = None, intensity: float | None = None
) -> float:
    """Standard deviation sigma_1 of the normal turbulence model.

    Args:
      speed: V_hub [m/s].
      wind_class: name of the class, or a user-defined class.
      edition: edition of a class given by name: 2, 3 or 4; 3 by default.
      intensity: intensity of the longitudinal component [-], in place of that of the class.

    Returns:
      sigma_1 [m/s]: I_ref (0.75 V_hub + 5.6 m/s); in edition 2 I_15 (15 m/s + a V_hub) / (a + 1).

    Raises:
      InputError: the class is unknown, or the speed or intensity is invalid.

    Source: ed. 3, clause 6.3.1.3, eq. 11; ed. 4, clause 6.3.2; ed. 2, clause 6.3.1.3.
    """
    c, v_hub = as_class(wind_class, edition), positive_speed("NTM", speed)
    if intensity is not None:
        return positive_intensity(intensity) * v_hub
    if c.a is not None:
        return c.i_ref * (15.0 + c.a * v_hub) / (c.a + 1.0)
    return c.i_ref * (0.75 * v_hub + NTM_B)


def positive_intensity(intensity: float) -> float:
    """Validate a turbulence intensity."""
    if not 0.0 <= intensity < 2.0:
        raise InputError(f"intensity must be from 0 to less than 2 (0.14 is 14 %), found {intensity!r}")
    return float(intensity)


def sigma_etm(speed: float, wind_class: str | WindClass, *, edition: Edition | None = None) -> float:
    """Standard deviation sigma_1 of the extreme turbulence model.

    Args:
      speed: V_hub [m/s].
      wind_class: name of the class, or a user-defined class.
      edition: edition of a class given by name: 3 (default) or 4.

    Returns:
      sigma_1 [m/s]: c I_ref (0.072 (V_ave / c + 3) (V_hub / c - 4) + 10), c = 2 m/s.

    Raises:
      InputError: the class is unknown, the speed is invalid, or edition 2, which has no such model.

    Source: ed. 3, clause 6.3.2.3, eq. 19; ed. 4, clause 6.3.3.
    """
    k, v_hub = as_class(wind_class, edition), positive_speed("ETM", speed)
    if k.edition == 2:
        raise InputError("ETM: edition 2 has no extreme turbulence model; expected edition 3 or 4")
    return ETM_C * k.i_ref * (0.072 * (k.v_ave / ETM_C + 3.0) * (v_hub / ETM_C - 4.0) + 10.0)


def extreme_speed(
    wind_class: str | WindClass, *, years: Literal[1, 50] = 50, steady: bool = True, edition: Edition | None = None
) -> float:
    """Speed of the extreme wind speed model at hub height.

    Args:
      wind_class: name of the class, or a user-defined class.
      years: recurrence period: 1 or 50.
      steady: the 3 s gust of the steady model; if not, the 10 min mean of the turbulent one.
      edition: edition of a class given by name: 2, 3 or 4; 3 by default.

    Returns:
      V_e50 = 1.4 V_ref or V_e1 = 0.8 V_e50; V_50 = V_ref or V_1 = 0.8 V_50 [m/s].

    Raises:
      InputError: unknown class or recurrence period.
      UnsupportedError: edition 2 with 1 year or turbulence.

    Source: ed. 3, clause 6.3.2.1, eq. 12 to 15; ed. 4, clause 6.3.3; ed. 2, clause 6.3.2.1.
    """
    c = as_class(wind_class, edition)
    if years not in (1, 50):
        raise InputError(f"EWM: years: expected 1 or 50, found {years!r}")
    if c.edition == 2 and not (steady and years == 50):
        raise UnsupportedError("EWM: edition 2 has the steady 50-year wind only; expected edition 3 or 4")
    speed = c.v_storm * (GUST_FACTOR if steady else 1.0)
    return speed * (ONE_YEAR if years == 1 else 1.0)


def operating_gust_limit(k: WindClass) -> float:
    """V_e1 [m/s] for the operating gust: based on V_ref also for tropical cyclones."""
    return ONE_YEAR * GUST_FACTOR * k.v_ref
