"""Controllers of the test bench: names, files, functions and objects, in production and under supervision."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

from meltemi.control.controller import Controller
from meltemi.controllers.python import checked_controller
from meltemi.controllers.schemes import make_controller, tuned_schemes
from meltemi.controllers.specification import BaselineCase, check_files, description, specification, supervised_form
from meltemi.controllers.trial import try_controllers
from meltemi.simulation.bladed.rotor import BladedModel
from meltemi.turbine.definition import Turbine

Entry = Controller | Callable[[Turbine], Controller] | str
"""A controller, a function of the turbine that returns one, or a name or file."""


@dataclass(frozen=True)
class Contender:
    """A controller on the bench.

    Attributes:
      name: name in tables.
      controller: controller in production.
      operating: controller in starts, stops and grid losses: with meltemi's supervisor where there is one.
      about: description.
    """

    name: str
    controller: Controller = field(repr=False)
    operating: Controller = field(repr=False)
    about: str = ""


def contenders(
    entries: Mapping[str, Entry], model: BladedModel, *, progress: Callable[[float], None] | None = None
) -> list[Contender]:
    """Controllers for a turbine, in their order, each of which worked for a few steps.

    Args:
      entries: controllers by label; names and files are those of docs/guide/controller-names.md.
      model: model of the turbine with the actuators that the schemes require, for which controllers are created.
      progress: callback with the completed fraction of the tuning.

    Raises:
      InputError: a name is unknown, a file or function is missing, or makes no controller, or one that fails in its
        first steps.
    """
    cases = {label: specification(entry) for label, entry in entries.items() if isinstance(entry, str)}
    for case in cases.values():
        check_files(case)
    schemes = {case.scheme for case in cases.values() if isinstance(case, BaselineCase) and case.scheme is not None}
    settings, _ = tuned_schemes(model, sorted(schemes), progress=progress)
    result = []
    for label, entry in entries.items():
        if isinstance(entry, Controller):
            result.append(Contender(label, entry, entry, f"controller {entry.name}"))
        elif callable(entry):
            controller = checked_controller(label, entry, model.turbine)
            result.append(
                Contender(label, controller, controller, f"function {getattr(entry, '__name__', type(entry).__name__)}")
            )
        else:
            case = cases[label]
            if isinstance(case, BaselineCase) and case.scheme is not None:
                case = case.replace(load=settings[case.scheme])
            controller, whole = make_controller(case, model, name=label), supervised_form(case)
            operating = controller if whole in (None, case) else make_controller(whole, model)
            result.append(Contender(label, controller, operating, description(case)))
    try_controllers({each.name: each.controller for each in result}, model)
    return result
