"""``bench_controllers``: any controllers on the test bench, by name or as objects."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from meltemi.control.controller import Controller
from meltemi.controllers.names import SCHEMES, controller_keys, labelled
from meltemi.controllers.schemes import equipped
from meltemi.core.errors import InputError
from meltemi.environment.grid import PowerGrid
from meltemi.iec.classes import as_class
from meltemi.simulation.options import ModelOptions
from meltemi.simulation.rotors import build
from meltemi.tuning.controller_bench.bench import ControllerBench
from meltemi.tuning.controller_bench.contenders import Entry, contenders
from meltemi.tuning.controller_bench.margins import Multisine
from meltemi.tuning.controller_bench.runs import run_bench
from meltemi.tuning.controller_bench.suite import BenchLimits, suite_of
from meltemi.turbine.definition import Turbine
from meltemi.turbine.power_turbine import AnyTurbine, aeroelastic

QUICK_SINE = Multisine(period=50.0, settling=150.0)
"""Test signal of the margins in the reduced suite."""
TUNING = 0.05
"""Share of the time that the tuning of schemes takes, for the progress."""


def bench_controllers(  # noqa: PLR0913 - options of a study, each with a default
    turbine: AnyTurbine,
    controllers: Mapping[str, Controller | Callable[[Turbine], Controller] | str] | Sequence[str],
    *,
    reference: str = "baseline",
    quick: bool = False,
    wind_class: str = "IB",
    limits: BenchLimits | None = None,
    options: ModelOptions | None = None,
    grid: PowerGrid | None = None,
    workers: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> ControllerBench:
    """Run controllers through the fixed suite of the test bench, in the same winds as a reference, and judge them.

    Args:
      turbine: turbine of the controllers; it receives flaps if a scheme needs them.
      controllers: names and files (docs/guide/controller-names.md), or by label controllers, functions of the turbine
        that return one, and names.
      reference: label of one of them, or another name; changes are against it.
      quick: the reduced suite.
      wind_class: class of IEC 61400-1.
      limits: limits of the verdicts.
      options: options of the model.
      grid: grid with a power reference outside starts, stops and grid losses; all controllers follow it.
      workers: number of threads.
      progress: callback with the completed fraction.

    Raises:
      InputError: a name or class is unknown, a file or function is missing or makes no controller, or no run at all
        reached its end.
      KeyboardInterrupt: Ctrl-C ended the runs.
    """
    bare = aeroelastic(turbine, "the test bench")
    if not isinstance(controllers, Mapping | str):
        controllers = one_name(controllers, bare)
    given = entries_of(controllers, one_name([reference], bare)[0])
    as_class(wind_class, None)
    described = equipped(bare, [e for e in given.values() if isinstance(e, str)])
    suite, model = suite_of(described, quick=quick), build(described, options)
    share = TUNING if progress else 0.0
    entries = contenders(given, model, progress=progress and (lambda x: progress(share * x)))
    return run_bench(
        model,
        entries,
        suite,
        wind_class=wind_class,
        limits=limits,
        sine=QUICK_SINE if quick else None,
        grid=grid,
        workers=workers,
        progress=progress and (lambda x: progress(share + (1.0 - share) * x)),
    )


def one_name(names: Sequence[str], turbine: Turbine) -> list[str]:
    """Names of controllers, with ``baseline`` for a scheme that adds nothing to it, such as ``cpc``.

    Where the pitch actuator has dynamics, schemes have a notch filter, and ``cpc`` is not the baseline.
    """
    plain = turbine.pitch_actuator.kind == "ideal"
    bare = {name for name, scheme in SCHEMES.items() if plain and not (scheme.loops or scheme.feedforward)}
    common = ["baseline" if isinstance(name, str) and name.lower() in bare else name for name in names]
    return [name for i, name in enumerate(common) if name not in common[:i] or names[i] in names[:i]]


def entries_of(controllers: Mapping[str, Entry] | Sequence[str], reference: str) -> dict[str, Entry]:
    """Controllers by label, the reference first; their names are checked.

    Raises:
      InputError: there are none, one is no controller, a name is unknown, or two have the same label.
    """
    if isinstance(controllers, Mapping):
        entries = dict(controllers)
    else:
        entries = dict(labelled([controllers] if isinstance(controllers, str) else list(controllers)))
    for label, entry in entries.items():
        if not (isinstance(entry, Controller | str) or callable(entry)):
            raise InputError(
                f"controllers: {label!r}: expected a controller, a function of the turbine or a name, "
                f"found {type(entry).__name__}"
            )
        if isinstance(entry, str):
            controller_keys(entry)
    if not entries:
        labelled([])
    if reference in entries:
        return {reference: entries.pop(reference), **entries}
    ((label, name),) = labelled([reference]).items()
    if entries.get(label, name) != name:
        raise InputError(f"controllers: two of them are called {label!r}")
    return {label: name, **entries}
