"""``meltemi verify``: comparison with closed forms, published tables, OpenFAST, HAWC2 and measurements."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from meltemi.core.errors import InputError
from meltemi.core.extras import skipped
from meltemi.verification import (
    closed_form,
    far_bending,
    hawc2,
    iea,
    members,
    modes,
    momentum,
    published,
    rotor,
    steady,
    uae,
)
from meltemi.verification.known import KNOWN
from meltemi.verification.table import CheckStudy, CheckTable, KnownDeviation, VerificationReport

WINDIO = ("windIO",)
QUICK: tuple[CheckStudy, ...] = (
    CheckStudy(8.0, closed_form.structure),
    CheckStudy(12.0, momentum.momentum),
    CheckStudy(8.0, published.report_steady),
    CheckStudy(1.0, published.report_modes),
    CheckStudy(1.0, modes.linearised),
    CheckStudy(1.0, rotor.performance),
    CheckStudy(4.0, lambda: steady.steady("A")),
    CheckStudy(2.0, lambda: steady.spanwise("A")),
    CheckStudy(2.0, rotor.power_in_yaw),
)
FULL: tuple[CheckStudy, ...] = (
    *QUICK,
    CheckStudy(12.0, closed_form.energy_to_the_last_digit),
    CheckStudy(20.0, far_bending.far_bending, "large deflections of the IEA blades", WINDIO),
    CheckStudy(12.0, lambda: steady.steady("B")),
    CheckStudy(2.0, lambda: steady.spanwise("B")),
    CheckStudy(1.0, iea.frequencies, "frequencies of the IEA turbines", WINDIO),
    CheckStudy(8.0, iea.steady_15mw, "IEA 15 MW, steady operation", WINDIO),
    CheckStudy(5.0, iea.steady_22mw, "IEA 22 MW, steady operation", WINDIO),
    CheckStudy(20.0, iea.modes_22mw, "IEA 22 MW, aeroelastic modes", WINDIO),
    CheckStudy(10.0, hawc2.iea10mw),
)


def verification(
    *,
    quick: bool = False,
    measured: bool = False,
    models: Path | None = None,
    frames: Path | None = None,
    progress: Callable[[float], None] = lambda share: None,
    say: Callable[[str], None] = lambda text: None,
    done: Callable[[CheckTable], object] = lambda comparison: None,
) -> VerificationReport:
    """Run all comparisons; those that need a package that is not installed are skipped.

    Args:
      quick: only what takes less than two minutes.
      measured: only the comparison with measured loads.
      models: folder with models of HAWC2; only the comparisons with HAWC2's and HAWCStab2's figures for them.
      frames: folder with runs of OpenFAST on a jacket and a tripod; only the comparisons with them.
      progress: called with the completed fraction.
      say: called at the start with what is skipped.
      done: callback for each completed comparison, with verdicts.

    Raises:
      InputError: a folder lacks models or runs, or ``measured``, ``models`` or ``frames`` is not alone.
    """
    kinds = {"--measured": measured, "--hawc2": models is not None, "--members": frames is not None}
    for name, alone in kinds.items():
        if alone and (quick or sum(kinds.values()) > 1):
            raise InputError(f"{name} excludes the other options: leave them out")
    studies = uae.MEASURED if measured else QUICK if quick else FULL
    if models is not None:
        studies = hawc2.studies(models)
    if frames is not None:
        studies = members.studies(frames)
    return report_of(compared(studies, KNOWN, progress, say, done), measured, models, frames)


def compared(
    studies: Sequence[CheckStudy],
    known: Sequence[KnownDeviation],
    progress: Callable[[float], None],
    say: Callable[[str], None],
    done: Callable[[CheckTable], object],
) -> list[CheckTable]:
    """The comparisons of studies, with verdicts; those that need a package that is not installed are skipped."""
    absent = skipped({study.what: study.needs for study in studies if study.needs})
    for words in absent.values():
        say(words)
    studies = [study for study in studies if study.what not in absent]
    total, passed = sum(study.seconds for study in studies), 0.0
    tables: list[CheckTable] = []
    for study in studies:
        tables.append(study.compare().judged(known))
        done(tables[-1])
        passed += study.seconds
        progress(passed / total)
    return tables


def report_of(
    tables: Sequence[CheckTable], measured: bool = False, models: Path | None = None, frames: Path | None = None
) -> VerificationReport:
    """The report of all comparisons, or of those completed before an interruption."""
    alone = {"measurements": measured, "hawc2": models is not None, "members": frames is not None}
    return VerificationReport(tables, next((name for name, asked in alone.items() if asked), "verification"))
