"""Makes the reference data of parked rotors for the comparisons with stored runs from a folder of OpenFAST runs.

    python tools/parked_tables.py FOLDER

Only needed when the reference runs change; users never call it. FOLDER has ``openfast_dlc`` with ``cases.json``,
``statistics.csv`` and ``series``.
"""

from __future__ import annotations

import csv
import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from reference_tables import ABOUT_WIND, pack, thin, write

from comparisons.measure import amplitudes, vibration
from comparisons.parked import CHANNELS, EDGEWISE, FLAPWISE, MEASURES, SHORT
from meltemi.postprocess.files.openfast import si_unit
from meltemi.wind_files import read_bts

SOURCE = "OpenFAST v5.0.0, NREL 5 MW land-based, deck of the ROSCO test cases (Apache-2.0), parked: no controller"
SUFFIXES = {
    "uni": "no shear",
    "ua": "dynamic stall",
    "setB": "set B",
    "nacyaw": "nacelle turned",
    "twraero": "tower drag",
    "6rpm": "from 6 rpm",
}
VIBRATIONS = {
    "P_idle_42.5_y+30": (EDGEWISE, 28.0, 44.0),
    "P_idle_42.5_y+30_nacyaw": (EDGEWISE, 28.0, 44.0),
    "P_idle_59.5_y-15": (EDGEWISE, 4.0, 20.0),
    "P_idle_59.5_y-15_ua": (EDGEWISE, 12.0, 24.0),
    "P_lock_42.5_y+30_az0": (EDGEWISE, 8.0, 40.0),
    "P_lock_42.5_y+30_az30": (FLAPWISE, 20.0, 52.0),
}
"""Direction and part of the series in which a vibration grows or persists."""
WIND_STEP = 0.2
"""[m/s] to which the wind is rounded."""
SHOWN = ("P_idle_42.5_y+30", "P_idle_59.5_y-15", "P_idle_59.5_y-15_ua")


def label(case: str) -> str:
    """Name of a case in words."""
    group, kind, speed, yaw, *rest = case.split("_")
    suffixes = [SUFFIXES[x] for x in rest if x in SUFFIXES]
    yaw = f"{yaw[1:]} deg"
    if group == "T":
        return f"idling in turbulence {yaw}"
    what = {"idle": "idling", "lock": "locked", "stuck1": "one blade at 0 deg"}[kind]
    at = [f"at {x[2:]} deg" for x in rest if x.startswith("az")]
    where = [] if kind == "stuck1" else [yaw]
    return ", ".join([" ".join([what, f"{speed} m/s", *where, *at]), *suffixes])


def main(folder: Path) -> None:
    runs = folder / "openfast_dlc"
    settings = json.loads((runs / "cases.json").read_text())
    chosen = [n for n in settings if n[0] in "PT" and not n.endswith("dt005")]

    def series(case: str) -> dict[str, np.ndarray]:
        z = np.load(runs / f"series/{case}.npz")
        data = z["data"].astype(float)
        return {str(c): data[:, i] * si_unit(str(z["units"][i]))[1] for i, c in enumerate(z["channels"])}

    rows: list[list[object]] = []
    for name in chosen:
        c = settings[name]
        steady = c["wind"][0] == "steady"
        speed, shear = c["wind"][1:] if steady else ("", "")
        first = c["pitch"][0] if isinstance(c["pitch"], list) else c["pitch"]
        angles = (c["propdir"], c["nacyaw"], c["azimuth"], first)
        switches = (int(not c["gendof"]), int(c.get("twraero", False)))
        rest = (30 if steady else SHORT.begin, speed, shear, *angles, c["rpm"], *switches, c["aero"])
        rows.append([label(name), c["tmax"], *rest])
        if not steady:
            rows.append([label(name) + SHORT.suffix, SHORT.end, *rest])
    head = "case duration begin speed shear direction_deg nacelle_deg azimuth_deg pitch_1_deg rpm locked tower_drag set"
    write("parked_cases", "parked and idling: wind and start of each case", head, rows, units="", source=SOURCE)

    statistics: dict[tuple[str, str], dict[str, str]] = {}
    with (runs / "statistics.csv").open() as file:
        for r in csv.DictReader(file):
            if r["window"] in ("steady", "turb"):
                statistics[r["case"], r["channel"]] = r
    rows = []
    for name in chosen:
        all_channels = series(name)
        for channel in CHANNELS:
            r = statistics[name, channel]
            factor = si_unit(r["unit"])[1]
            values = [float(r[k]) * factor for k in ("mean", "std", "min", "max")]
            rows.append([label(name), channel, *(f"{v:.7g}" for v in (*values, np.ptp(all_channels[channel])))])
        if name[0] == "T":
            t = all_channels["Time"]
            part, inside = t <= SHORT.end + 1e-6, (t >= SHORT.begin - 1e-6) & (t <= SHORT.end + 1e-6)
            for channel in CHANNELS:
                x = all_channels[channel]
                values = [float(measure(x[inside])) for measure in MEASURES.values()]
                rows.append([label(name) + SHORT.suffix, channel, *(f"{v:.7g}" for v in (*values, np.ptp(x[part])))])
    what = "parked and idling: statistics from the begin of the evaluation, and range of the whole case, start included"
    write("parked", what, "case channel mean std minimum maximum range", rows, source=SOURCE)

    rows, shown = [], []
    for name, (direction, begin, end) in VIBRATIONS.items():
        s = series(name)
        blades = np.stack([s[f"{direction.channel}{b}"] for b in (1, 2, 3)])
        values = vibration(s["Time"], blades, direction.band, (begin, end))
        rows.append([label(name), direction.name, begin, end, *(f"{v:.6g}" for v in values)])
        if name in SHOWN:
            amplitude, _ = amplitudes(s["Time"], blades, direction.band)
            shown += [[label(name), t, f"{np.interp(t, s['Time'], amplitude):.5g}"] for t in range(4, 67, 2)]
    what = "blades of parked rotors in stall: frequency [Hz] and damping ratio from begin to end, last amplitude [m]"
    write("parked_vibration", what, "case direction begin end frequency damping amplitude", rows, source=SOURCE)
    what = "edgewise vibration of idling rotors in stall: amplitude of all blades"
    write("parked_amplitude", what, "case time amplitude", shown, source=SOURCE)

    box = read_bts(runs / "wind/ewm42.5_s1.bts")
    about = f"wind of 42.5 m/s, turbulence intensity 11 %; TurbSim of OpenFAST v5.0.0, seed 30101; {ABOUT_WIND}"
    pack("parked_wind", about, **thin(box, SHORT.end + 4.0, WIND_STEP))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
