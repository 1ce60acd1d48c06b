"""Control schemes by name, tuned for a turbine: configurations of He et al. (2018), parts and alternatives of them.

``ipc`` is CPC with feed-forward and 1P feedback to pitch, ``cpfc`` is ``ipc`` with 2P feedback to flaps: the load is
divided by frequency. A scheme may also be a user-defined Python file with ``controller(turbine)``, see
docs/guide/comparing.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

from meltemi.control.controller import Controller
from meltemi.control.load_control import FeedForward, LoadControl, LoadController
from meltemi.core.errors import InputError
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.studies.scheme_names import SCHEMES, check_schemes, is_file, label
from meltemi.studies.tuning import LoopTuning, linear_models, speed_notch, tune_loops
from meltemi.turbine.definition import Turbine
from meltemi.turbine.flaps import with_flaps


@dataclass(frozen=True)
class SchemeDesign:
    """Controllers of the schemes for a turbine, and the tuning of their loops.

    Attributes:
      controllers: by name of the scheme.
      settings: of the schemes' load control, by name.
      tunings: by scheme and loop, such as ``cpfc: 2P flap``; once for schemes that share all loops.
    """

    controllers: Mapping[str, Controller]
    settings: Mapping[str, LoadControl]
    tunings: Mapping[str, LoopTuning]


def equipped(turbine: Turbine, names: Iterable[str]) -> Turbine:
    """The turbine, with the flaps of He et al. (2018) if a scheme requires flaps and it has none."""
    wants = any(SCHEMES[name].flaps for name in names if name in SCHEMES)
    return with_flaps(turbine) if wants and not turbine.blade.flaps else turbine


def design_controllers(
    model: BladedModel,
    names: Sequence[str],
    *,
    shear_exponent: float = 0.2,
    progress: Callable[[float], None] | None = None,
) -> SchemeDesign:
    """Design the controllers of schemes; :func:`~meltemi.studies.tuning.tune_loops` tunes the loops of each together.

    All have the same collective law, with a notch filter at the drivetrain resonance if the pitch actuator has dynamics
    (docs/theory/control.md, C-31).

    Args:
      model: of a turbine with the actuators that the schemes require, see :func:`equipped`.
      names: of schemes, or paths of Python files.
      shear_exponent: assumed by the feed-forward.
      progress: callback with the completed fraction.

    Raises:
      InputError: as :func:`~meltemi.studies.scheme_names.check_schemes`, or a file does not give a controller.
    """
    check_schemes(names)
    own = {name: own_controller(name, model.turbine) for name in names if is_file(name)}  # errors in them come first
    schemes = {name: SCHEMES[name] for name in names if name in SCHEMES}
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
    controllers = {
        label(name): LoadController(model.turbine, settings[name], name=name) if name in schemes else own[name]
        for name in names
    }
    tunings = {
        f"{', '.join(name for name in schemes if schemes[name].loops == wanted)}: {harmonic}P {actuator}": tuning
        for wanted, found in tuned.items()
        for (actuator, harmonic), tuning in zip(wanted, found, strict=True)
    }
    return SchemeDesign(controllers, settings, tunings)


def own_controller(path: str, turbine: Turbine) -> Controller:
    """The controller of a user's Python file with a function ``controller(turbine)``.

    Raises:
      InputError: the file cannot be run, has no such function, or the function returns no controller.
    """
    found: Callable[[Turbine], object] | None = getattr(_module(path), "controller", None)
    if not callable(found):
        raise InputError(f"{path}: expected a function controller(turbine) that returns a meltemi.Controller")
    return checked_controller(path, found, turbine)


def checked_controller(where: str, make: Callable[[Turbine], object], turbine: Turbine) -> Controller:
    """The controller that a user's function makes for a turbine.

    Raises:
      InputError: the function raises, or returns no controller.
    """
    try:
        made = make(turbine)
    except Exception as error:
        raise InputError(f"{where}: controller(turbine) raised {type(error).__name__}: {error}") from error
    if not isinstance(made, Controller):
        raise InputError(f"{where}: controller(turbine) must return a meltemi.Controller, found {type(made).__name__}")
    return made


def _module(path: str) -> ModuleType:
    import importlib.util
    import sys

    name = f"meltemi_own_{Path(path).stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path}: expected a Python file (.py)")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    try:
        spec.loader.exec_module(module)
    except Exception as error:
        raise InputError(f"{path}: {type(error).__name__}: {error}") from error
    return module
