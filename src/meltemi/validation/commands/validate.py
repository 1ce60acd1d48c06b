"""``meltemi validate``: measured records of a turbine against its simulations."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from meltemi.app.options import WorkOptions
from meltemi.app.scans import finish
from meltemi.app.signatures import Range
from meltemi.app.terminal import OutOption, made_by, print_table, progress_bar, simulation_bar, suggest, warn, wrote
from meltemi.core.errors import InputError
from meltemi.core.extras import need

if TYPE_CHECKING:
    from meltemi.validation.issues import DataIssue
    from meltemi.validation.selection import SelectedRecord


def validate(
    file: Annotated[Path, "File of the validation (docs/guide/validation.md)."],
    work: WorkOptions,
    data: Annotated[Path | None, "Folder of the measured files [that of FILE]."] = None,
    seeds: Annotated[int | None, "Wind fields of each record [that of the file].", Range(1, 1000)] = None,
    why: Annotated[int, "Records of which sensitivities to uncertain parameters are computed.", Range(0, 1000)] = 3,
    fit: Annotated[
        tuple[str, ...] | None, "Fit these parameters on half of the records: pitch_offset,drag ... [none]."
    ] = None,
    out: OutOption = Path("out"),
) -> None:
    """Compare measured ten-minute records with simulations in the wind that was measured: report, tables."""
    need("meltemi validate", "pandas", "python-docx")
    from meltemi.cases.case import read_case
    from meltemi.core.fingerprint import fingerprint
    from meltemi.core.yamlfile import read_record
    from meltemi.reports.blocks import Section
    from meltemi.tuning.run_store import run_store
    from meltemi.validation import fit as fitting
    from meltemi.validation.comparison import Comparison
    from meltemi.validation.gauges import calibration_table, calibrations_of, in_moments
    from meltemi.validation.measurements import read_measurements
    from meltemi.validation.plausibility import plausible
    from meltemi.validation.quality import doubtful
    from meltemi.validation.report import Findings, agreement_table, write_findings
    from meltemi.validation.selection import select
    from meltemi.validation.settings import Validation
    from meltemi.validation.simulations import Simulator, compared_channels, gauges_of, simulate_records

    settings = read_record(file, Validation)
    settings = settings if seeds is None else settings.replace(seeds=seeds)
    place, data = file.parent / settings.case, file.parent if data is None else data
    simulator = Simulator.of(settings, read_case(place), place.parent)
    names = compared_channels(settings)
    with progress_bar("reading") as progress:
        progress(0.0)
        measured = read_measurements(data, channels := settings.channels)
        issues = [*doubtful(measured, channels), *plausible(measured, channels, simulator.turbine)]
        calibrations = calibrations_of(measured, simulator.turbine, settings.idle, settings.yaw_sweep)
        measured = in_moments(measured, calibrations)
        selected = select(measured, simulator.turbine, wind=channels.wind, issues=issues, rules=settings.selection)
    used = [each.record for each in selected if not each.rejected and each.operation == "production"]
    if not used:
        raise InputError(f"{data}: no record can be compared: {_reasons(selected, issues)}")
    raw, range_only = gauges_of(settings, calibrations)
    names = tuple(name for name in names if name not in raw)
    parameters = fitting.checked(fit or (), settings, names)
    fitting.check_fit(simulator, used, parameters)
    warn(
        f"{name}: a gauge in mV/V without calibration is not compared; give its gain, or idle: [files]" for name in raw
    )
    warn(dict.fromkeys(str(issue) for issue in issues))
    runs, length = len(used) * settings.seeds, sum(record.length for record in used) * settings.seeds
    inputs = f"{fingerprint('validate', simulator.case, settings, used)}"
    with run_store(out, inputs, "meltemi.validation", **work.divided()):
        read = time.perf_counter()
        with simulation_bar(f"{len(used)} records, {settings.seeds} seeds", runs, "runs") as progress:
            records, failed = simulate_records(simulator, used, names, workers=work.workers, progress=progress)
        spent = time.perf_counter() - read
        comparison = Comparison(tuple(records), names, range_only, settings.accuracy)
        if not records:
            raise InputError(f"{data}: no record could be simulated: {next(iter(failed.values()))}")
        with simulation_bar("sensitivities") as progress:
            further = [*fitting.sections(simulator, used, comparison, parameters, why=why, progress=progress)]
    if calibrations:
        further.append(Section("Gauges", [calibration_table(calibrations)]))
    facts = {
        "Turbine": simulator.turbine.name,
        "Records": f"{len(records)} compared of {len(selected)}",
        "Seeds": str(settings.seeds),
        "Simulated": f"{length / 3600.0:.1f} h in {spent:.0f} s",
    }
    findings = Findings(
        f"Measured and simulated: {simulator.turbine.name}",
        comparison,
        selected,
        issues,
        failed,
        [*facts.items()],
        further,
        **made_by(),
    )
    shown = agreement_table(findings.headline)
    print_table(f"{simulator.turbine.name}: {len(records)} records, {settings.seeds} seeds", shown.head, shown.texts, 3)
    print(f"{runs} runs in {spent:.1f} s ({length / max(spent, 1e-9):.0f} times real time)")
    wrote(*write_findings(findings, out))
    suggest("validate", file, "--data", data, *([] if parameters else ["--fit", "air_density,pitch_offset"]))
    finish(f"not simulated: {name}: {why}" for name, why in failed.items())


def _reasons(selected: Sequence[SelectedRecord], issues: Sequence[DataIssue]) -> str:
    """Why no record is used, with what to do about issues."""
    reasons = dict.fromkeys(each.rejected or f"{each.operation}, not production" for each in selected)
    texts = {f"{issue.kind} in {issue.channel or issue.file}": str(issue) for issue in reversed(issues)}
    return "; ".join([texts.get(reason, reason) for reason in [*reasons][:5]]) or "no records"
