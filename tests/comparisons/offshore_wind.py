"""The IEA 15 MW on its monopile in wind and sea under ROSCO against OpenFAST, in the same wind and waves.

The turbine is that of ``offshore``, in motion; ROSCO has the settings of the deck.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from comparisons import thinned
from comparisons.floating import TIME_STEP, Wind, full_series, rosco_of, spread, wind_and_sea
from comparisons.offshore import DECK, RELEASED, STEP, monopile_model
from meltemi.simulation.result import Result
from meltemi.simulation.simulate import simulate
from meltemi.simulation.start import Start
from meltemi.verification.table import Check, CheckTable, at_least, relative

STEADY = {"M4_8": Wind(8.0, 5.73, 0.0), "M4_12": Wind(12.0, 7.56, 7.0), "M4_18": Wind(18.0, 7.56, 15.5)}
TURBULENT = {"M5_12": Wind("kai12_s1.bts", 7.56, 7.0), "M5_18_dir60": Wind("kai18_s2.bts", 7.56, 15.5)}
CHANNELS = (
    "RotSpeed BldPitch1 GenPwr RtFldFxh RtFldMxh RootMyc1 RootMxc1 OoPDefl1 TTDspFA TTDspSS TwrBsFxt TwrBsFyt "
    "TwrBsMxt TwrBsMyt HydroFxi HydroFyi ReactFXss ReactFYss ReactMXss ReactMYss M3N1MKye M5N1MKye"
).split()
IN_TURBULENCE = [*CHANNELS, "TwrBsFzt"]
MEAN, BANDS, CORRELATION = 1.0, (1.0, 2.0), 0.99
"""[%] of means; of standard deviations and equivalent loads; [-]."""
STEADY_BEGIN, BEGIN = 30.0, 40.0
"""[s] begin of the compared part."""


def wind_run(case: str, duration: float, folder: Path | None = None, *, step: float = STEP, **changes: Any) -> Result:
    """Our run of a case, which for a box needs the folder of the reference runs, with its sea; a record every ``step``
    [s]."""
    settings = (STEADY | TURBULENT)[case]
    wind, sea = wind_and_sea(case, settings, folder)
    options: dict[str, Any] = {"time_step": TIME_STEP, "locked": ("drivetrain", "yaw")} | changes
    model = monopile_model(air=True, **options)
    with TemporaryDirectory() as scratch:
        return simulate(
            model,
            wind,
            duration=duration,
            sea=sea,
            controller=rosco_of(DECK, model.turbine, Path(scratch)),
            start=Start(settings.rotor_speed * np.pi / 30.0, np.radians(settings.pitch), coordinates=RELEASED),
            channels=IN_TURBULENCE,
            output_step=step,
        )


def steady() -> CheckTable:
    """Steady wind in still water; forces of the water, which only rests, are left out."""
    rows: list[Check] = []
    data = thinned("offshore_wind_runs")
    for case in STEADY:
        reference = data[f"{case}_counts"] * data[f"{case}_steps"]
        time = STEP * np.arange(float(len(reference)))
        ours, inside = wind_run(case, float(time[-1])), time >= STEADY_BEGIN - 1e-6
        for name, series in zip(CHANNELS, reference[inside].T, strict=True):
            if not name.startswith("Hydro"):
                unit, mean, floor = ours.channel(name).unit, float(series.mean()), float(series.std())
                found = float(ours[name][: len(time)][inside].mean())
                rows.append(relative(f"{name} mean", case, unit, mean, found, MEAN, floor=floor))
                rows += spread(name, case, ours, series, inside, STEP, BANDS)
    source = "OpenFAST v5.0.0 with HydroDyn, SubDyn and ROSCO 2.10.6 (cases M4), 30 to 60 s after the release"
    return CheckTable("offshore wind", "IEA 15 MW on its monopile in steady wind, under ROSCO", source, rows)


def turbulent(folder: Path) -> CheckTable:
    """Turbulence and sea.

    Raises:
      InputError: the folder has no such runs.
    """
    rows: list[Check] = []
    for case in TURBULENT:
        reference = full_series(folder / f"series/{case}.npz", IN_TURBULENCE, STEP)
        time = STEP * np.arange(float(len(reference)))
        ours, inside = wind_run(case, float(time[-1]), folder), time >= BEGIN - 1e-6
        for name, series in zip(IN_TURBULENCE, reference[inside].T, strict=True):
            rows += spread(name, case, ours, series, inside, STEP, BANDS)
            found = float(np.corrcoef(ours[name][: len(time)][inside], series)[0, 1])
            rows.append(at_least(f"{name} correlation", case, "-", CORRELATION, found))
    source = "OpenFAST v5.0.0 with SeaState, HydroDyn, SubDyn and ROSCO 2.10.6, the same wind and waves (cases M5)"
    title = "IEA 15 MW on its monopile in turbulence and sea, under ROSCO"
    return CheckTable("offshore turbulence", title, source, rows)
