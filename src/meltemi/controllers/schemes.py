"""Controllers of a turbine from their specification; control schemes are tuned for it.

``ipc`` is CPC with feed-forward and 1P feedback to pitch, ``cpfc`` is ``ipc`` with 2P feedback to flaps: the load is
divided by frequency. All names and files: docs/guide/controller-names.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from meltemi.analyses.performance import performance_of
from meltemi.bladed_controllers.controller import BladedController
from meltemi.bladed_controllers.rosco import find_rosco, rosco_example
from meltemi.control.baseline import BaselineController
from meltemi.control.constant import ConstantController
from meltemi.control.controller import Controller
from meltemi.control_laws.load_control import FeedForward, LoadControl, LoadController
from meltemi.control_laws.yaw import YawController
from meltemi.controllers.names import SCHEMES, labelled, need_flaps
from meltemi.controllers.python import checked_controller, function_of, is_path
from meltemi.controllers.specification import (
    ROSCO,
    BaselineCase,
    ControllerCase,
    FixedCase,
    LibraryCase,
    PowerCase,
    PythonCase,
    SupervisedCase,
    check_files,
    specification,
    uses_flaps,
)
from meltemi.controllers.tuning import LoopTuning, linear_models, speed_notch, tune_loops
from meltemi.core.errors import InputError
from meltemi.power_control.coordinated import CoordinatedController
from meltemi.power_control.settings import PowerControl
from meltemi.simulation.bladed.rotor import BladedModel, with_blades
from meltemi.simulation.model import Model
from meltemi.supervisor.supervised import SupervisedController
from meltemi.turbine.definition import Turbine
from meltemi.turbine.flaps import with_flaps
from meltemi.turbine.power_turbine import AnyTurbine, aeroelastic

EXAMPLES = {"nrel5mw": "Test_Cases/NREL-5MW/DISCON.IN"}
"""Input files of ROSCO's examples by turbine."""


@dataclass(frozen=True)
class SchemeDesign:
    """Controllers for a turbine, and the tuning of the loops of its schemes.

    Attributes:
      controllers: controllers by label.
      settings: settings of the load control of schemes, by name.
      tunings: tunings by scheme and loop, such as ``cpfc: 2P flap``; once for schemes that share all loops.
    """

    controllers: Mapping[str, Controller]
    settings: Mapping[str, LoadControl]
    tunings: Mapping[str, LoopTuning]


def equipped(turbine: Turbine, names: Iterable[str]) -> Turbine:
    """The turbine, with the flaps of He et al. (2018) if a scheme requires flaps and it has none."""
    return with_flaps(turbine) if need_flaps(names) and not turbine.blade.flaps else turbine


def fitted(turbine: AnyTurbine, case: ControllerCase) -> AnyTurbine:
    """The turbine for a controller: with the flaps of He et al. (2018) if it requires flaps and there are none.

    Raises:
      InputError: flaps are required, and the turbine is a power-coefficient turbine.
    """
    if not uses_flaps(case) or turbine.flaps:
        return turbine
    return with_flaps(aeroelastic(turbine, f"scheme {getattr(case, 'scheme', '')}"))


def design_controllers(
    model: BladedModel,
    names: Sequence[str],
    *,
    shear_exponent: float = 0.2,
    progress: Callable[[float], None] | None = None,
) -> SchemeDesign:
    """Controllers of a turbine by name; :func:`~meltemi.controllers.tuning.tune_loops` tunes the loops of schemes.

    All schemes have the same collective law, with a notch filter at the drivetrain resonance if the pitch actuator has
    dynamics (docs/theory/control.md, C-31).

    Args:
      model: model of a turbine with the actuators that the schemes require, see :func:`equipped`.
      names: names of controllers: schemes, supervised, A0 to A3, rosco, Python files, libraries ...
      shear_exponent: shear exponent that the feed-forward assumes.
      progress: callback with the completed fraction.

    Raises:
      InputError: a name is unknown or repeated, or a file is missing or provides no controller.
    """
    cases = {name_of: specification(name) for name_of, name in labelled(names).items()}
    for case in cases.values():
        check_files(case)
    schemes = [case.scheme for case in cases.values() if isinstance(case, BaselineCase) and case.scheme is not None]
    others = {
        name_of: make_controller(case, model, name=name_of)  # report their errors first
        for name_of, case in cases.items()
        if getattr(case, "scheme", None) not in schemes
    }
    settings, tunings = tuned_schemes(model, schemes, shear_exponent=shear_exponent, progress=progress)
    controllers = {
        name_of: others[name_of]
        if name_of in others
        else make_controller(case.replace(load=settings[str(case.scheme)]), model, name=name_of)  # type: ignore[union-attr]
        for name_of, case in cases.items()
    }
    return SchemeDesign(controllers, settings, tunings)


def tuned_schemes(
    model: BladedModel,
    names: Sequence[str],
    *,
    shear_exponent: float = 0.2,
    progress: Callable[[float], None] | None = None,
) -> tuple[dict[str, LoadControl], dict[str, LoopTuning]]:
    """Load control of schemes by name, and the tuning of their loops, see :class:`SchemeDesign`.

    Arguments are those of :func:`design_controllers`.
    """
    schemes = {name: SCHEMES[name] for name in names}
    loops = any(scheme.loops for scheme in schemes.values())
    ideal = model.turbine.pitch_actuator.kind == "ideal"
    linear = linear_models(model, progress=progress) if loops or (schemes and not ideal) else []
    notch = speed_notch(linear[0]) if linear and not ideal else None
    tuned = {
        wanted: tune_loops(model, wanted, linear=linear) for wanted in dict.fromkeys(s.loops for s in schemes.values())
    }
    feedforward = FeedForward(shear_exponent=shear_exponent)
    settings = {
        name: LoadControl(
            feedforward=feedforward if scheme.feedforward else None,
            loops=tuple(tuning.loop for tuning in tuned[scheme.loops]),
            notch=notch,
        )
        for name, scheme in schemes.items()
    }
    tunings = {
        f"{', '.join(name for name in schemes if schemes[name].loops == wanted)}: {harmonic}P {actuator}": tuning
        for wanted, loop_tunings in tuned.items()
        for (actuator, harmonic), tuning in zip(wanted, loop_tunings, strict=True)
    }
    return settings, tunings


def settled(case: ControllerCase, model: Model[Any], progress: Callable[[float], None] | None = None) -> ControllerCase:
    """The controller with the tuned gains of its scheme, if it has a scheme without gains."""
    if not isinstance(case, BaselineCase | SupervisedCase) or case.scheme is None or case.load is not None:
        return case
    settings, _ = tuned_schemes(with_blades(model, f"scheme {case.scheme}"), [case.scheme], progress=progress)
    return case.replace(load=settings[case.scheme])


def make_controller(
    given: str | ControllerCase, model: Model[Any], *, folder: Path = Path(), kept: Path | None = None, name: str = ""
) -> Controller:
    """The controller of a name, file or specification for the turbine of a model.

    Args:
      given: name of a controller (docs/guide/controller-names.md), or the record of a case file.
      model: turbine model, with flaps if a scheme needs them; the loops of a scheme are tuned for it.
      folder: folder to which paths are relative.
      kept: working folder of a library; by default a temporary one.
      name: name for messages.

    Raises:
      InputError: the name or file does not exist, or provides no controller for this turbine.
    """
    case, turbine = settled(specification(given), model), model.turbine
    if isinstance(case, LibraryCase):
        return _library(case, turbine, folder, kept, name)
    if isinstance(case, PythonCase):
        file = str(folder / case.file) if is_path(case.file) else case.file
        where = file if is_path(file) else f"controller {file}:{case.function}"
        return checked_controller(where, function_of(file, case.function), turbine)
    if isinstance(case, SupervisedCase):
        keys = {key: getattr(case, key) for key in ("load", "yaw", "protection", "sample_time")}
        return SupervisedController(turbine, case.supervision, **keys)
    if isinstance(case, PowerCase):
        power = case.model_dump(exclude={"kind", "yaw", "relief", "load", "sample_time"}, exclude_unset=True)
        keys = {key: getattr(case, key) for key in ("yaw", "relief", "load", "sample_time")}
        return CoordinatedController(turbine, performance_of(turbine), power=PowerControl(**power), **keys)
    if isinstance(case, FixedCase):
        return ConstantController()
    if case.load is not None:
        return LoadController(turbine, case.load, name=name or case.scheme or "load control")
    return BaselineController(turbine) if case.yaw is None else YawController(turbine, case.yaw)


def located(case: ControllerCase, turbine: AnyTurbine) -> Any:
    """The controller with its input file; by default ROSCO uses the turbine's file, or ROSCO's example of the turbine.

    Raises:
      InputError: no input file is available.
    """
    if not isinstance(case, LibraryCase) or case.library != ROSCO or case.input is not None:
        return case
    if turbine.control.discon is None and turbine.name not in EXAMPLES:
        raise InputError(
            f"controller rosco: needs its settings for {turbine.name}: rosco@DISCON.IN or --controller-input "
            "DISCON.IN (in a case file controller.input, in the turbine's control.discon)"
        )
    return case.replace(input=turbine.control.discon or str(rosco_example(EXAMPLES[turbine.name])))


def _library(case: LibraryCase, turbine: AnyTurbine, folder: Path, kept: Path | None, name: str) -> Controller:
    """The controller of a library."""
    file = located(case, turbine).input
    return BladedController(
        turbine,
        find_rosco() if case.library == ROSCO else folder / case.library,
        None if file is None else folder / file,
        folder=kept,
        name=name,
        **case.model_dump(exclude={"kind", "library", "input"}),
    )
