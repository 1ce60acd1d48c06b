"""Wind models of IEC 61400-1 by name, for the command line and case files.

One table lists every model with its clause; one function creates any of them and checks its options.

Reference: docs/theory/iec.md.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal

from meltemi.core.errors import InputError, did_you_mean
from meltemi.iec.classes import CLASSES, Edition, WindClass, as_class
from meltemi.iec.gusts import ecd, ecg, edc, eog, ews_horizontal, ews_vertical
from meltemi.iec.winds import TURBULENCE, etm, ewm_steady, ewm_turbulent, ntm, nwp
from meltemi.turbine.power_turbine import AnyTurbine
from meltemi.wind.fields import SteadyWind, WindSeries
from meltemi.wind.turbulent import TurbulentWind

IecWind = SteadyWind | WindSeries | TurbulentWind
SITUATION = ("turbine", "wind_class", "edition")
"""Arguments that every case has; models that do not depend on them ignore them."""


@dataclass(frozen=True)
class IecModel:
    """A wind model of IEC 61400-1.

    Attributes:
      name: as the standard abbreviates it; EWM with its years, EWS with H or V.
      title: description.
      kind: kind of its wind: turbulent, steady, or a transient.
      clause, equations: clause and equations of edition 3; of edition 2 for ECG.
      make: function that creates its wind.
      make_steady: function of the steady variant, if there are both.
      editions: editions with this model.
    """

    name: str
    title: str
    kind: Literal["turbulent", "steady", "transient"]
    clause: str
    equations: str
    make: Callable[..., IecWind]
    make_steady: Callable[..., IecWind] | None = None
    editions: tuple[Edition, ...] = (2, 3, 4)

    def takes(self, *, steady: bool = False) -> tuple[str, ...]:
        """Names of the arguments."""
        make = _function(self, steady)
        fixed = make.keywords if isinstance(make, partial) else {}
        names = [p.name for p in inspect.signature(make).parameters.values() if p.kind is not p.VAR_KEYWORD]
        free = TURBULENCE if "turbulence" in inspect.signature(make).parameters else ()
        both = ("steady",) if self.make_steady else ()
        return (*(n for n in names if n not in fixed), *both, *free)

    def needs(self, *, steady: bool = False) -> tuple[str, ...]:
        """Names of the required arguments."""
        parameters = inspect.signature(_function(self, steady)).parameters.values()
        return tuple(p.name for p in parameters if p.default is p.empty and p.kind is not p.VAR_KEYWORD)


def _function(model: IecModel, steady: bool) -> Callable[..., IecWind]:
    return model.make_steady if steady and model.make_steady else model.make


_TABLE = (
    IecModel("NWP", "normal wind profile", "steady", "6.3.1.2", "10", nwp),
    IecModel("NTM", "normal turbulence model", "turbulent", "6.3.1.3", "11", ntm),
    IecModel("ETM", "extreme turbulence model", "turbulent", "6.3.2.3", "19", etm, editions=(3, 4)),
    IecModel(
        "EWM1",
        "extreme wind speed model, 1 year",
        "turbulent",
        "6.3.2.1",
        "12 to 16",
        partial(ewm_turbulent, years=1),
        partial(ewm_steady, years=1),
        editions=(3, 4),
    ),
    IecModel(
        "EWM50",
        "extreme wind speed model, 50 years",
        "turbulent",
        "6.3.2.1",
        "12 to 16",
        partial(ewm_turbulent, years=50),
        partial(ewm_steady, years=50),
    ),
    IecModel("EOG", "extreme operating gust", "transient", "6.3.2.2", "17, 18", eog),
    IecModel("EDC", "extreme direction change", "transient", "6.3.2.4", "20, 21", edc),
    IecModel("ECD", "extreme coherent gust with direction change", "transient", "6.3.2.5", "22 to 25", ecd),
    IecModel("ECG", "extreme coherent gust", "transient", "6.3.2.4", "", ecg, editions=(2,)),
    IecModel("EWSH", "extreme wind shear, horizontal", "transient", "6.3.2.6", "27", ews_horizontal),
    IecModel("EWSV", "extreme wind shear, vertical", "transient", "6.3.2.6", "26", ews_vertical),
)
MODELS: dict[str, IecModel] = {model.name: model for model in _TABLE}
"""The models by name."""


def iec_wind(  # noqa: PLR0913 - quantities that the standard names
    model: str,
    *,
    turbine: AnyTurbine | None = None,
    wind_class: str | WindClass | None = None,
    edition: Edition | None = None,
    speed: float | None = None,
    sign: Literal[1, -1] | None = None,
    begin: float | None = None,
    years: Literal[1, 50] | None = None,
    intensity: float | None = None,
    steady: bool | None = None,
    **turbulence: Any,
) -> IecWind:
    """Wind of IEC 61400-1 by the name of its model.

    Turbine, class and edition describe the situation and are ignored by models that do not depend on them. All
    else is an option of the model, and an error for others.

    Args:
      model: NWP, NTM, ETM, EWM1, EWM50, EOG, EDC, ECD, ECG, EWSH or EWSV.
      turbine: turbine, for its hub height and rotor diameter, for transients.
      wind_class: name of the class (``IIB``), or a user-defined class.
      edition: edition of IEC 61400-1: 2, 3 or 4; 3 by default, 2 for ECG, that of the class if it is a record.
      speed: V_hub [m/s]; EWM has that of the class.
      sign: sign of EDC, ECD, EWSH and EWSV: +1 (default) or -1.
      begin: [s] begin of a transient; 60 by default.
      years: recurrence period for EOG and EDC of edition 2: 1 or 50.
      intensity: turbulence intensity [-], in place of that of the class: NTM, EOG, EDC, EWSH and EWSV.
      steady: the steady variant of EWM1 and EWM50 in place of the turbulent one.
      turbulence: the ``direction`` [rad] of any model; of turbulent ones further fields of a :class:`TurbulentWind`,
        such as ``seed``.

    Returns:
      The wind: turbulent, steady or a series, as the model is.

    Raises:
      InputError: unknown model, option or class; something missing; a value out of range.
      UnsupportedError: a wind of edition 2 that is not implemented.
    """
    if model not in MODELS:
        raise InputError(f"IEC wind: unknown model {model!r}; {did_you_mean(str(model), MODELS)}")
    m, steady_form = MODELS[model], bool(steady)
    situation: dict[str, Any] = {"turbine": turbine, "wind_class": wind_class, "edition": edition}
    options = {"speed": speed, "sign": sign, "begin": begin, "years": years, "intensity": intensity, "steady": steady}
    given = {name: value for name, value in options.items() if value is not None} | turbulence
    takes = m.takes(steady=steady_form)
    for name in given:
        if name not in takes:
            valid = [n for n in takes if n not in SITUATION]
            hint = did_you_mean(name, valid) if name not in options else f"valid are: {', '.join(valid)}"
            raise InputError(f"{model} ({m.title}) has no argument {name!r}; {hint}")
    given.pop("steady", None)
    given |= {name: value for name, value in situation.items() if value is not None and name in takes}
    if missing := [name for name in m.needs(steady=steady_form) if name not in given]:
        raise InputError(f"{model} ({m.title}) needs {' and '.join(missing)}")
    used = as_class(wind_class, edition).edition if isinstance(wind_class, WindClass) else edition
    if used is not None and used not in m.editions:
        known = " or ".join(str(e) for e in m.editions)
        raise InputError(f"{model} ({m.title}) is not in edition {used}; expected edition {known}")
    if isinstance(wind_class, str) and not any(wind_class in classes for classes in CLASSES.values()):
        as_class(wind_class, edition)  # check arguments that a model ignores, too
    return _function(m, steady_form)(**given)
