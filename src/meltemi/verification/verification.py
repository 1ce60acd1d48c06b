"""``meltemi verify``: comparison with closed forms, published tables, OpenFAST and measurements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from meltemi.core.errors import InputError
from meltemi.core.extras import skipped
from meltemi.verification import (
    closed_form,
    elastodyn_blade,
    far_bending,
    floating,
    hawc2,
    iea,
    modes,
    momentum,
    offshore,
    offshore_wind,
    parked,
    published,
    rigid,
    steady,
    stops,
    transient,
    turbulent,
    uae,
    yaw,
)
from meltemi.verification.known import KNOWN
from meltemi.verification.table import Comparison, Report, Study

WINDIO = ("windIO",)
QUICK: tuple[Study, ...] = (
    Study(8.0, closed_form.structure),
    Study(12.0, momentum.momentum),
    Study(8.0, published.report_steady),
    Study(1.0, published.report_modes),
    Study(1.0, modes.linearised),
    Study(2.0, modes.decays),
    Study(1.0, elastodyn_blade.discretisation),
    Study(1.0, rigid.performance),
    Study(3.0, rigid.fixed_rotor),
    Study(1.0, rigid.spin),
    Study(2.0, rigid.pitch_steps),
    Study(4.0, lambda: steady.steady("A")),
    Study(2.0, lambda: steady.spanwise("A")),
    Study(3.0, lambda: steady.periodic("A", ("shear_8", "shear_12", "shear_20", "yaw20_10"))),
    Study(1.0, lambda: yaw.yawed("A")),
    Study(2.0, yaw.power_in_yaw),
    Study(2.0, transient.gust),
    Study(2.0, transient.step),
    Study(4.0, stops.gusts),
    Study(3.0, stops.stops),
    Study(2.0, partial(turbulent.turbulence, "A")),
    Study(1.0, partial(turbulent.turbulence, "B")),
    Study(4.0, parked.parked),
    Study(2.0, parked.stalled),
    Study(1.0, parked.turbulent),
)
FULL: tuple[Study, ...] = (
    *QUICK,
    Study(12.0, closed_form.energy_to_the_last_digit),
    Study(20.0, far_bending.far_bending, "large deflections of the IEA blades", WINDIO),
    Study(12.0, lambda: steady.steady("B")),
    Study(2.0, lambda: steady.spanwise("B")),
    Study(2.0, lambda: steady.periodic("B", ("shear_12", "yaw20_10"))),
    Study(1.0, lambda: yaw.yawed("B")),
    Study(5.0, parked.discretised),
    Study(1.0, iea.frequencies, "frequencies of the IEA turbines", WINDIO),
    Study(8.0, iea.steady_15mw, "IEA 15 MW, steady operation", WINDIO),
    Study(5.0, iea.steady_22mw, "IEA 22 MW, steady operation", WINDIO),
    Study(20.0, iea.modes_22mw, "IEA 22 MW, aeroelastic modes", WINDIO),
    Study(10.0, hawc2.iea10mw),
)

OFFSHORE: tuple[Study, ...] = (
    Study(60.0, offshore.frequencies, "frequencies on the monopile", ("rosco", *WINDIO)),
    Study(30.0, offshore.waves, "monopile in waves", ("rosco", *WINDIO)),
    Study(15.0, offshore_wind.steady, "monopile under ROSCO", ("rosco", *WINDIO)),
    Study(60.0, floating.floating, "floating platform", ("rosco",)),
    Study(40.0, floating.in_wind, "floating platform under ROSCO", ("rosco",)),
)


def verification(
    *,
    quick: bool = False,
    measured: bool = False,
    at_sea: bool = False,
    models: Path | None = None,
    reference: Path | None = None,
    progress: Callable[[float], None] = lambda share: None,
    say: Callable[[str], None] = lambda text: None,
    done: Callable[[Comparison], object] = lambda comparison: None,
) -> Report:
    """Run all comparisons; those that need a package that is not installed are skipped.

    Args:
      quick: only what takes less than two minutes.
      measured: only the comparison with measured loads.
      at_sea: only the comparisons of turbines at sea.
      models: folder with models of HAWC2; only the comparisons with HAWC2's and HAWCStab2's figures for them.
      reference: folder with the series and wind boxes of the reference runs, for turbulence over ten minutes beside
        the 45 s that come with the package, and for a stop in turbulence; with ``at_sea`` for turbulence and sea.
      progress: called with the completed fraction.
      say: called at the start with what is skipped.
      done: called with each comparison as soon as it is made, with verdicts.

    Raises:
      InputError: a folder lacks reference runs or models, or ``measured``, ``at_sea`` or ``models`` is not alone.
    """
    kinds = {"--measured": measured, "--offshore": at_sea, "--hawc2": models is not None}
    for name, alone in kinds.items():
        if alone and (quick or (reference is not None and not at_sea) or sum(kinds.values()) > 1):
            raise InputError(f"{name} is a comparison of its own: leave out the other options")
    needed = "openfast_offshore" if at_sea else "openfast"
    if reference is not None and not (reference / needed).is_dir():
        raise InputError(f"--reference {reference}: no folder {needed!r} in it")
    studies = [*(uae.MEASURED if measured else OFFSHORE if at_sea else QUICK if quick else FULL)]
    if models is not None:
        studies = [*hawc2.studies(models)]
    if reference is not None and at_sea:
        further = partial(floating.in_wind, reference / needed)
        studies = [s._replace(compare=further) if s.compare is floating.in_wind else s for s in studies]
        windy = partial(offshore_wind.turbulent, reference / needed)
        studies.insert(3, Study(10.0, windy, "monopile in turbulence", ("rosco", *WINDIO)))
    elif reference is not None:
        studies += [Study(10.0, partial(turbulent.turbulence, aero, reference)) for aero in "AB"]
        if (reference / "openfast_dlc").is_dir():
            studies.append(Study(2.0, partial(parked.turbulent, reference)))
        studies.append(Study(1.0, partial(stops.stops, reference)))
    elif at_sea:
        say("turbulence and sea under ROSCO: skipped, their wind boxes need --reference")
    absent = skipped({study.what: study.needs for study in studies if study.needs})
    for words in absent.values():
        say(words)
    studies = [study for study in studies if study.what not in absent]
    total, passed = sum(study.seconds for study in studies), 0.0
    tables: list[Comparison] = []
    for study in studies:
        tables.append(study.compare().judged(KNOWN))
        done(tables[-1])
        passed += study.seconds
        progress(passed / total)
    return report_of(tables, measured, at_sea, models)


def report_of(
    tables: Sequence[Comparison], measured: bool = False, at_sea: bool = False, models: Path | None = None
) -> Report:
    """The report of comparisons, all of them or those made before an interruption."""
    alone = {"measurements": measured, "offshore": at_sea, "hawc2": models is not None}
    return Report(tables, next((name for name, chosen in alone.items() if chosen), "verification"))
