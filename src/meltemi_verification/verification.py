"""``meltemi verify``: comparison with closed forms, published tables, OpenFAST and measurements."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from meltemi.core.errors import InputError
from meltemi_verification import (
    closed_form,
    elastodyn_blade,
    far_bending,
    iea,
    modes,
    momentum,
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
from meltemi_verification.known import KNOWN
from meltemi_verification.table import Comparison, Report

Study = tuple[float, Callable[[], Comparison]]
QUICK: tuple[Study, ...] = (
    (8.0, closed_form.structure),
    (4.0, momentum.momentum),
    (8.0, published.report_steady),
    (1.0, published.report_modes),
    (1.0, modes.linearised),
    (2.0, modes.decays),
    (1.0, elastodyn_blade.discretisation),
    (1.0, rigid.performance),
    (3.0, rigid.fixed_rotor),
    (1.0, rigid.spin),
    (2.0, rigid.pitch_steps),
    (12.0, lambda: steady.steady("A")),
    (2.0, lambda: steady.spanwise("A")),
    (3.0, lambda: steady.periodic("A", ("shear_8", "shear_12", "shear_20", "yaw20_10"))),
    (1.0, lambda: yaw.yawed("A")),
    (2.0, yaw.power_in_yaw),
    (2.0, transient.gust),
    (2.0, transient.step),
    (4.0, stops.gusts),
    (3.0, stops.stops),
    (2.0, partial(turbulent.turbulence, "A")),
    (1.0, partial(turbulent.turbulence, "B")),
    (4.0, parked.parked),
    (2.0, parked.stalled),
    (1.0, parked.turbulent),
)
"""Studies with their usual duration [s]."""
IEA: tuple[Study, ...] = (
    (1.0, iea.frequencies),
    (8.0, iea.steady_15mw),
    (5.0, iea.steady_22mw),
    (20.0, iea.modes_22mw),
)
FULL: tuple[Study, ...] = (
    *QUICK,
    (12.0, closed_form.energy_to_the_last_digit),
    (20.0, far_bending.far_bending),
    (12.0, lambda: steady.steady("B")),
    (2.0, lambda: steady.spanwise("B")),
    (2.0, lambda: steady.periodic("B", ("shear_12", "yaw20_10"))),
    (1.0, lambda: yaw.yawed("B")),
    (5.0, parked.discretised),
    *(IEA if iea.installed() else ()),
)


def verification(
    *,
    quick: bool = False,
    measured: bool = False,
    reference: Path | None = None,
    progress: Callable[[float], None] = lambda share: None,
) -> Report:
    """Run all comparisons.

    Args:
      quick: only what takes less than two minutes.
      measured: only the comparison with measured loads.
      reference: folder with the series and wind boxes of the reference runs, for turbulence over ten minutes beside
        the 45 s that come with the package, and for a stop in turbulence.
      progress: called with the completed fraction.

    Raises:
      InputError: the folder has no reference runs, or ``measured`` is combined with others.
    """
    if measured and (quick or reference is not None):
        raise InputError("--measured is a comparison of its own: leave out --quick and --reference")
    if reference is not None and not (reference / "openfast").is_dir():
        raise InputError(f"--reference {reference}: no folder 'openfast' in it")
    studies = [*(uae.MEASURED if measured else QUICK if quick else FULL)]
    if reference is not None:
        studies += [(10.0, partial(turbulent.turbulence, aero, reference)) for aero in "AB"]
        if (reference / "openfast_dlc").is_dir():
            studies.append((2.0, partial(parked.turbulent, reference)))
        studies.append((1.0, partial(stops.stops, reference)))
    total, done = sum(seconds for seconds, _ in studies), 0.0
    tables: list[Comparison] = []
    for seconds, study in studies:
        tables.append(study())
        done += seconds
        progress(done / total)
    return Report([table.judged(KNOWN) for table in tables], "measurements" if measured else "verification")
