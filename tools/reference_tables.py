"""Makes reference tables of ``meltemi verify`` and the stored runs of ``tests/comparisons`` from runs of OpenFAST.

    python tools/reference_tables.py FOLDER

Only needed when the reference runs change; users never call it. The series in turbulence are thinned so that every
machine can repeat a minute of OpenFAST's runs, from its initial conditions and in its wind:

- ``turbulent_wind.npz``: the first 70 s of the wind, the grid points near the rotor, rounded to 0.1 m/s and stored as
  differences from plane to plane;
- ``stops_runs.npz``: pitch, generator torque and speed of the runs in gusts and of the stops up to the stop, every
  0.05 s, and some channels of two of them;
- ``turbulent_runs.npz``: 20 to 65 s of the runs in that wind, every second sample, each channel rounded to a step of
  at most 1/2000 of its range, in OpenFAST's units; and one root moment of all four runs from 100 to 700 s.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from comparisons.floating import CASES as FLOAT_CASES
from comparisons.floating import CHANNELS as FLOAT_CHANNELS
from comparisons.floating import STEP as FLOAT_STEP
from comparisons.floating import WIND_CHANNELS as FLOAT_WIND_CHANNELS
from comparisons.floating import WINDS as FLOAT_WINDS
from comparisons.measure import decay, extremes, harmonic, undershoot
from comparisons.offshore import CASES as SEA_CASES
from comparisons.offshore import CHANNELS as SEA_CHANNELS
from comparisons.offshore import STEP as SEA_STEP
from comparisons.offshore_wind import CHANNELS as SEA_WIND_CHANNELS
from comparisons.offshore_wind import STEADY as SEA_WINDS
from comparisons.stops import BEGIN, FIGURE, OUTPUT, SHOWN, STOPS, gust_cases, measured
from comparisons.stops import CHANNELS as STOP_CHANNELS
from comparisons.turbulent import CHANNELS, SHORT
from meltemi.exchange.openfast.text import key, number, read_input, split
from meltemi.postprocess.statistics import means_over_revolutions
from meltemi.simulation.channels import standard
from meltemi.wind.fields import WindBox
from meltemi.wind_files import read_bts

SOURCE = (
    "OpenFAST v5.0.0, NREL 5 MW land-based, deck of the ROSCO test cases (Apache-2.0) with the baseline controller "
    "of NREL/TP-500-38060"
)
ROOT = Path(__file__).parents[1]
DATA, TESTS = ROOT / "src/meltemi/verification/data", ROOT / "tests"
RUNS = TESTS / "comparisons/data"
OF_RUNS = (
    "azimuth decay fixed pitch_step spin yaw gust gust_wind step stops parked parked_cases parked_vibration "
    "parked_amplitude"
).split()
"""Tables that belong to stored runs."""
WINDS = ("4", "6", "8", "10", "11.4", "12", "13", "15", "18", "20", "22", "24")
STEADY = (
    "GenPwr RotSpeed BldPitch1 RotThrust RotTorq RotPwr RtFldFxh RootMyc1 RootMxc1 OoPDefl1 IPDefl1 TTDspFA TwrBsMyt "
    "TwrBsMxt YawBrMyp YawBrMzp"
).split()
FACTOR = {
    "kN": 1e3, "kN-m": 1e3, "kW": 1e3, "deg": np.pi / 180, "rpm": np.pi / 30, "m": 1, "N": 1, "N-m": 1, "m/s": 1,
    "rad": 1, "m/s^2": 1, "-": 1, "N/m": 1, "s": 1, "W": 1,
}  # fmt: skip
GUST = "Wind1VelX GenPwr RotSpeed BldPitch1 RtFldFxh RootMyc1 OoPDefl1 TTDspFA TwrBsMyt".split()
YAWED = (
    "GenPwr RotSpeed YawBrFxp YawBrFyp YawBrFzp YawBrMxp YawBrMyp YawBrMzp TwrBsFxt TwrBsFyt TwrBsMxt TwrBsMyt "
    "TwrBsMzt RootFxc1 RootFyc1 RootFzc1 RootMxc1 RootMyc1 RootMzc1"
).split()
NODES = "Alpha AxInd TnInd Cl Cd Fx Fy".split()
WIND_SECONDS, WIND_STEP = 70.0, 0.1
REACH = 68.0
"""[m] of the blade tips from the middle of the rotor, with deflections."""
DECK = {
    "main": "5MW.fst",
    "ElastoDyn": "ElastoDyn.dat",
    "ElastoDyn blade": "ElastoDyn_blade.dat",
    "ElastoDyn tower": "ElastoDyn_tower.dat",
    "BeamDyn": "BeamDyn.dat",
    "AeroDyn": "AeroDyn.dat",
    "AeroDyn blade": "AeroDyn_blade.dat",
    "airfoil": "Airfoils/DU21_A17.dat",
    "InflowWind": "InflowWind.dat",
    "ServoDyn": "ServoDyn.dat",
}
ABOUT_WIND = (
    "its begin at the points near the rotor; near (Z, Y), grid: dt [s], dy, dz, bottom [m], speed [m/s], step [m/s]; "
    "first (points, 3) and steps (T - 1, points, 3) count steps"
)
TURBULENCE = "the NREL 5 MW at 20 m/s, turbulence intensity 14 % (von Karman, IEC 61400-1 ed. 2)"


def main(folder: Path) -> None:
    openfast = folder / "openfast"
    units = {}
    for name in ("A_steady_12", "A_eog_12"):
        z = np.load(openfast / f"series/{name}.npz")
        units |= dict(zip(map(str, z["channels"]), map(str, z["units"]), strict=True))

    def bins(case: str) -> dict[str, np.ndarray]:
        with (openfast / f"azbin/{case}.csv").open() as file:
            rows = list(csv.DictReader(file))
        return {k: np.array([float(r[k]) for r in rows]) * FACTOR.get(units.get(k, "-"), 1.0) for k in rows[0]}

    def series(case: str) -> dict[str, np.ndarray]:
        z = np.load(openfast / f"series/{case}.npz")
        names, data = list(map(str, z["channels"])), z["data"].astype(float)
        own = list(map(str, z["units"]))
        return {n: data[:, i] * FACTOR.get(own[i], 1.0) for i, n in enumerate(names)}

    rows: list[list[object]] = []
    for which in "AB":
        for wind in WINDS:
            b = bins(f"{which}_steady_{wind}")
            rows += [[which, wind, c, f"{b[c].mean():.7g}"] for c in STEADY]
    write("steady", "means over the azimuth bins of the last 60 s, uniform wind", "set wind channel value", rows)

    rows = []
    for case in ("A_steady_8", "A_steady_12", "A_steady_20", "B_steady_8", "B_steady_12", "B_steady_20"):
        z = np.load(openfast / f"series/{case}.npz")
        names = list(map(str, z["node_quantities"]))
        for quantity in NODES:
            scale = np.pi / 180 if quantity == "Alpha" else 1.0
            column = z["node_mean_last30s"][:, names.index(quantity)] * scale
            rows += [[case, n + 1, quantity, f"{x:.6g}"] for n, x in enumerate(column)]
    write("nodes", "means over the last 30 s at the nodes of blade 1", "case node quantity value", rows)

    rows = []
    for case in ("A_shear_8", "A_shear_12", "A_shear_20", "A_yaw20_10", "B_shear_12", "B_yaw20_10"):
        b = bins(case)
        for channel in ("RootMyc1", "RootMxc1", "OoPDefl1"):
            rows += [[case, channel, i, f"{x:.6g}"] for i, x in enumerate(b[channel])]
    write("azimuth", "means over 36 azimuth bins of the last 60 s", "case channel bin value", rows)

    rows = []
    for case in ("A_yaw20_10", "B_yaw20_10"):
        b = bins(case)
        psi = np.radians(b["azimuth_bin_centre_deg"])
        for channel in YAWED:
            x = b[channel]
            first, third = (2.0 * abs(np.mean(x * np.exp(1j * n * psi))) for n in (1, 3))
            rows.append([case[0], channel, f"{x.mean():.7g}", f"{first:.6g}", f"{third:.6g}"])
    write(
        "yaw",
        "10 m/s, 20 deg of yaw error: mean, amplitudes at 1P and 3P over 36 azimuth bins of the last 60 s",
        "set channel mean first third",
        rows,
    )

    rows = []
    for case in ("straight", "notower", "", "shear", "yaw20"):
        b = bins("A_fixed_12" + (f"_{case}" if case else ""))
        for channel in (
            "RtFldFxh RtFldMxh RootMyc1 RootMxc1 YawBrMyp YawBrMzp TwrBsMyt TwrBsMxt B1N2Alpha B1N4Alpha B1N6Alpha "
            "B1N2AxInd B1N4AxInd B1N6AxInd B1N2Fx B1N4Fx B1N6Fx B1N2Fy B1N4Fy B1N6Fy"
        ).split():
            amplitude = 0.5 * np.ptp(b[channel])
            rows.append([case or "as built", channel, f"{b[channel].mean():.7g}", f"{amplitude:.6g}"])
    write(
        "fixed",
        "rigid machine at 12.1 rpm, pitch 3.83 deg, 12 m/s: mean and half range over 36 azimuth bins",
        "case channel mean half_range",
        rows,
    )

    rows = []
    for which in "AB":
        s = series(f"{which}_eog_12")
        inside = (s["Time"] >= 80.0) & (s["Time"] <= 120.0)
        t = s["Time"][inside]
        for c in GUST:
            x = s[c][inside]
            rows.append([which, c, *(f"{v:.6g}" for v in (*extremes(t, x), np.ptp(x)))])
    write(
        "gust",
        "extreme operating gust at 12 m/s from 80 s: extremes between 80 and 120 s",
        "set channel minimum at_minimum maximum at_maximum peak_to_peak",
        rows,
    )

    rows = []
    for which in "AB":
        s = series(f"{which}_step_10_11")
        t = s["Time"]
        for c in "GenPwr RotSpeed RtFldFxh RootMyc1 TwrBsMyt".split():
            before, after = s[c][(t >= 110) & (t < 120)].mean(), s[c][(t >= 190) & (t < 200)].mean()
            means, at = means_over_revolutions(t, s["Azimuth"], s[c])
            late = at > 120.0
            rows.append([which, c, *(f"{v:.6g}" for v in (before, after, means[late].max()))])
    write(
        "step",
        "wind from 10 to 11 m/s at 120 s: means of 110-120 s and 190-200 s, largest average over a revolution",
        "set channel before after largest",
        rows,
    )

    rows = []
    for which in ("A", "B", "E", "E3"):
        s = series(f"{which}_pitchstep_10_rigid")
        t = s["Time"]
        for c in ("RtFldFxh", "RtFldMxh"):
            rows.append([which, c, *(f"{v:.6g}" for v in undershoot(t, s[c], 80.0))])
    write(
        "pitch_step",
        "rigid rotor without tilt, cone and tower, 10 m/s, 11.43 rpm, pitch 0 to 2 deg in 0.1 s: before, lowest, "
        "final, and seconds from the lowest value until 63.2 % of the undershoot are made good",
        "set channel before lowest final recovery",
        rows,
    )

    rows = []
    s = series("spin_vacuum_12rpm")
    t = s["Time"]
    psi, last = s["Azimuth"], t >= 60.0
    for c in "RootMyc1 RootMxc1 OoPDefl1 IPDefl1 RootFzc1 TwrBsMyt YawBrMyp TTDspFA".split():
        rows.append([c, *(f"{v:.6g}" for v in harmonic(psi[last], s[c][last]))])
    write(
        "spin",
        "12.1 rpm in vacuum with gravity, 60 to 120 s: mean and first harmonic over the azimuth of blade 1",
        "channel mean amplitude phase",
        rows,
    )

    rows = []
    for case, channel in (
        ("tower_fa", "TTDspFA"),
        ("tower_ss", "TTDspSS"),
        ("tower_fa_rigidblades_g0", "TTDspFA"),
        ("flap", "OoPDefl1"),
    ):
        s = series(f"decay_{case}")
        rows.append([case, channel, *(f"{v:.6g}" for v in decay(s["Time"], s[channel]))])
    write("decay", "free decays without aerodynamics, from 10 s", "case channel frequency_hz damping", rows)

    with (openfast / "frequencies.csv").open() as file:
        modes = [
            [r["case"], r["mode"], r["f_natural_Hz"], r["damping_pct_crit"], r["participation"]]
            for r in csv.DictReader(file)
        ]
    columns = "case mode frequency_hz damping_percent participation"
    write("modes", "linearised modes without aerodynamics", columns, modes)

    with (openfast / "cp_ct_rigid.csv").open() as file:
        grid = [[r["tsr"], r["pitch_deg"], r["Cp"], r["Ct"]] for r in csv.DictReader(file)]
    write(
        "performance",
        "aerodyn_driver, rigid rotor without tilt, cone and tower, 8 m/s, set A",
        "tip_speed_ratio pitch_deg power_coefficient thrust_coefficient",
        grid,
    )

    with (openfast / "wind/eog12.wnd").open() as file:
        lines = [line.split() for line in file if line[:1] != "!"]
    gusts: list[list[object]] = [[n[0], n[7]] for n in lines if 80.0 <= float(n[0]) <= 90.5]
    write("gust_wind", "extreme operating gust, added to 12 m/s", "time gust", gusts)

    keywords(folder / "decks/nrel5mw-land")
    deck_values(folder)
    thinned_wind(openfast)
    thinned_runs(openfast)
    stops(folder / "openfast_dlc")
    offshore(folder / "openfast_offshore")


def offshore(runs: Path) -> None:
    """The IEA 15 MW on its monopile and on the VolturnUS-S: waves of each case, and thinned series in SI."""
    setups = {
        "offshore_runs": (
            SEA_CASES,
            SEA_CHANNELS,
            SEA_STEP,
            "deck of ROSCO 2.10.6 with monopile; wave and current along x",
        ),
        "offshore_wind_runs": (
            SEA_WINDS,
            SEA_WIND_CHANNELS,
            SEA_STEP,
            "deck of ROSCO 2.10.6 with monopile, and its library, steady wind",
        ),
        "floating_runs": (
            FLOAT_CASES,
            FLOAT_CHANNELS,
            FLOAT_STEP,
            "deck of ROSCO 2.10.6 with VolturnUS-S, MoorDyn 2.3.8",
        ),
        "floating_wind_runs": (
            FLOAT_WINDS,
            FLOAT_WIND_CHANNELS,
            FLOAT_STEP,
            "deck of ROSCO 2.10.6 with VolturnUS-S, MoorDyn 2.3.8 and its library, steady wind",
        ),
    }
    for file, (cases, channels, step, deck) in setups.items():
        content: dict[str, np.ndarray] = {"channels": np.array(channels)}
        for case in cases:
            with np.load(runs / f"series/{case}.npz") as z:
                names, units, data = list(map(str, z["channels"])), list(map(str, z["units"])), z["data"].astype(float)
            factors = [FACTOR.get(units[names.index(name)].strip("()"), 1.0) for name in channels]
            every = round(step / (data[1, 0] - data[0, 0]))
            series = data[::every, [names.index(name) for name in channels]] * factors
            content[f"{case}_steps"], content[f"{case}_counts"] = rounded(series)
            assert np.allclose(np.diff(data[::every, 0]), step, atol=1e-3)
            if not case.startswith(("F2", "F5", "M4")):
                waves = np.atleast_2d(np.genfromtxt(runs / f"waves/{case}.csv", delimiter=",", skip_header=1))
                some = [1, 3, 4] if file == "offshore_runs" else [1, 3, 4, 5]
                content[f"{case}_waves"] = waves[waves[:, 3] > 1e-6][:, some]
                if file == "floating_runs":
                    content[f"{case}_waves"][:, 3] *= np.pi / 180.0
        air = "" if "wind" in file else ", parked, no air"
        about = f"OpenFAST v5.0.0, {deck}{air}; value = step * count, every {step:g} s; "
        about += "waves: frequency [rad/s], amplitude [m], phase [rad], direction [rad]"
        pack(file, about, **content)


def stops(runs: Path) -> None:
    """Extremes of the runs in gusts and of the stops; pitch, torque and speed that are played back."""
    rows: list[list[object]] = []
    content: dict[str, np.ndarray] = {"steps": np.array([2e-6, 5.0, 5e-4])}
    shown: dict[str, np.ndarray] = {}
    for name, case in (gust_cases() | STOPS).items():
        with np.load(runs / f"series/{'S' if case.events else 'G'}_{name}.npz") as z:
            names, units, data = list(map(str, z["channels"])), list(map(str, z["units"])), z["data"].astype(float)
        x = {n: data[:, i] * FACTOR.get(units[i], 1.0) for i, n in enumerate(names)}
        for channel in STOP_CHANNELS:
            rows.append([name, channel, *(f"{v:.6g}" for v in measured(x["Time"], x[channel], case.event).values())])
        if name in FIGURE:
            shown[name] = np.stack([x[c][(x["Time"] > 39.99) & (x["Time"] < 80.01)] for c in SHOWN], axis=1)
        if name.endswith("noROSCO"):
            continue
        # torque up to the switch, pitch up to the latest begin of its run to feather
        off = 55.35 if name.startswith("normal") else case.event if case.events else case.end
        keep, torque = x["Time"] < off + 0.21, x["GenTq"]
        if case.events:
            i = int(np.flatnonzero(x["Time"] > off - 0.01)[0])
            torque[i:] = 2.0 * torque[i - 1] - torque[i - 2]
        table = np.stack([x["BldPitch3"], torque, x["GenSpeed"]], axis=1)[keep]
        content[name] = differences(table, content["steps"])
        assert np.allclose(np.diff(x["Time"]), OUTPUT, atol=1e-4) and case.event >= BEGIN
    content["shown_steps"] = 10.0 ** np.floor(np.log10(np.ptp(np.concatenate([*shown.values()]), axis=0) / 2000.0))
    content |= {f"shown_{name}": differences(series, content["shown_steps"]) for name, series in shown.items()}
    head = " ".join(measured(x["Time"], x["Time"], BEGIN))
    source = "; aerodynamic set B; controller ROSCO 2.10.6 in place of the baseline controller"
    write(
        "stops",
        "IEC gusts, stops and faults: mean, least and largest value in the 10 s before the event, extremes from then "
        f"on, mean of the last 10 s, range{source}",
        f"case channel {head}",
        rows,
    )
    about = (
        f"{SOURCE}{source}; gusts and stops; pitch [rad], generator torque [N m], generator speed [rad/s] every 0.05 s "
        f"in steps, as differences from row to row; shown: {', '.join(SHOWN)} from 40 to 80 s"
    )
    pack("stops_runs", about, **content)


def differences(x: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Counts of steps as differences from row to row, the first from zero."""
    return np.diff(np.rint(x / steps).astype(np.int32), axis=0, prepend=0)


def keywords(deck: Path) -> None:
    """Keywords of the deck's files in their order."""
    rows: list[list[object]] = []
    for module, name in DECK.items():
        entries = [entry for several in read_input(deck / name, module).entries.values() for entry in several]
        rows += [[module, key(entry.name)] for entry in sorted(entries, key=lambda e: e.line)]
    rows = [row for row in rows if not str(row[1]).startswith("bldnd")]
    what = "keywords of input files in the order in which OpenFAST reads them"
    write("openfast_keywords", what, "module keyword", rows, units="")


def deck_values(folder: Path) -> None:
    """Values of the deck and of ROSCO's settings, file by file, for the tests of the reader: no text of these files."""
    deck, rosco = folder / "decks/nrel5mw-land", folder / "openfast_rosco/DISCON.IN"
    rows: list[list[object]] = []
    for path in (*sorted(p for p in deck.rglob("*") if p.suffix in (".fst", ".dat")), rosco):
        name = path.name if path == rosco else path.relative_to(deck).as_posix()
        rows += [[name, *row] for row in values_of(path)]
    what = "values of the input files; rows of tables without a keyword"
    write("nrel5mw_deck", what, "file keyword values", rows, units="", to=TESTS)


def values_of(path: Path) -> list[tuple[str, str]]:
    """Keywords and values of an input file in their order, its tables, and the names of its sections."""
    file = read_input(path, "any")
    entries = {entry.line: entry for several in file.entries.values() for entry in several}
    found: list[tuple[str, str]] = []
    outputs = False
    for i, line in enumerate(file.lines, start=1):
        bare = line.strip()
        words = split(bare)
        if i == 2 and file.lines[0].lstrip().startswith("--"):
            found.append(("title", "NREL 5 MW"))
        elif outputs:
            outputs = not bare.startswith("END")
            found += [] if outputs else [("END", "")]
        elif any(word.lower() == "outlist" for word in words[:2]):
            outputs = True
            found.append(("OutList", ""))
        elif i in entries:
            at = next(j for j, word in enumerate(words) if j and word.strip("!") == entries[i].name)
            found.append((entries[i].name, " ".join(word for word in words[:at] if word not in "!-")))
        elif not bare and found and found[-1][0] == "":
            found.append(("blank", ""))  # ends a table
        elif bare.lstrip("!").startswith(("---", "===")):
            found.append(("section", bare.strip("!-= ").split(" [")[0]))
        elif words and (number(words[0]) is not None or words[0][0] == '"'):
            texts = (j for j, word in enumerate(words) if number(word) is None and word[0] != '"')
            found.append(("", " ".join(words[: next(texts, len(words))])))
        elif i < len(file.lines) and file.lines[i].strip().lstrip("! ").startswith("("):  # units below the header
            found.append(("columns", " ".join(word for word in words if word.strip("!"))))
    return found


def thinned_wind(openfast: Path) -> None:
    """The thinned wind box of seed 1."""
    pack(
        "turbulent_wind",
        f"wind of {TURBULENCE}; TurbSim of OpenFAST v5.0.0, seed 20101; {ABOUT_WIND}",
        **thin(read_bts(openfast / "wind/vkm20_s1.bts"), WIND_SECONDS, WIND_STEP),
    )


def thin(box: WindBox, seconds: float, step: float) -> dict[str, np.ndarray]:
    """The begin of a wind box at the points near the rotor, in steps of a velocity [m/s]."""
    rows, columns = box.velocity.shape[1:3]
    y, z = (np.arange(columns) - (columns - 1) / 2) * box.dy, box.bottom + np.arange(rows) * box.dz
    near = np.zeros((rows, columns), bool)  # corners of the cells that the disk touches
    for i in range(rows - 1):
        for j in range(columns - 1):
            if np.hypot(np.clip(0.0, y[j], y[j + 1]), np.clip(91.0, z[i], z[i + 1]) - 91.0) < REACH:
                near[i : i + 2, j : j + 2] = True
    counts = np.rint(box.velocity[: round(seconds / box.dt), near] / step).astype(np.int16)
    steps = np.diff(counts, axis=0)
    assert np.abs(steps).max() < 128
    grid = np.array([box.dt, box.dy, box.dz, box.bottom, box.speed, step]).round(6)
    return {"near": near, "grid": grid, "first": counts[0], "steps": steps.astype(np.int8)}


def thinned_runs(openfast: Path) -> None:
    """The thinned series in turbulence."""
    known = {c.alias for c in standard().values()} | {"B1N1Alpha"}
    content: dict[str, np.ndarray] = {}
    for which, kept in (("A", known), ("B", set(CHANNELS))):
        z = np.load(openfast / f"series/{which}_turb_vkm20_s1.npz")
        names, units, data = list(map(str, z["channels"])), z["units"].astype(str), z["data"].astype(float)
        inside = (data[:, 0] > SHORT.begin - 1e-4) & (data[:, 0] < SHORT.end + 1e-4)
        columns = [i for i, name in enumerate(names) if i and name in kept]
        content[f"{which}_channels"], content[f"{which}_units"] = np.array(names)[columns], units[columns]
        content[f"{which}_steps"], content[f"{which}_counts"] = rounded(data[inside][::2, columns])
        content |= {"all_channels": np.array(names), "all_units": units}
    moments = []
    for case in ("A_turb_vkm20_s1", "A_turb_vkm20_s2", "B_turb_vkm20_s1", "B_turb_vkm20_s2"):
        z = np.load(openfast / f"series/{case}.npz")
        moments.append(z["data"][z["data"][:, 0] > 99.99, list(z["channels"]).index("RootMyc1")][::2])
    content["root_moment_steps"], content["root_moment_counts"] = rounded(np.array(moments, float).T)
    about = f"{SOURCE}; {TURBULENCE}, sets A and B, {SHORT.begin:g} to {SHORT.end:g} s; value = step * count; "
    pack("turbulent_runs", about + "root_moment: RootMyc1 [kN-m] of A and B with two seeds, 100 to 700 s", **content)


def rounded(data: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Steps of a power of ten of at most 1/2000 of each column's range, and the counts of them."""
    steps = 10.0 ** np.floor(np.log10(np.maximum(np.ptp(data, axis=0), 1e-12) / 2000.0))
    return steps, np.rint(data / steps).astype(np.int32)


def pack(name: str, about: str, **content: np.ndarray) -> None:
    path = RUNS / f"{name}.npz"
    np.savez_compressed(path, about=np.array(about), **content)
    print(f"{path.name}: {path.stat().st_size / 1e3:.0f} kB")


def write(
    name: str,
    what: str,
    head: str,
    rows: list[list[object]],
    units: str = "; SI units",
    to: Path | None = None,
    source: str = SOURCE,
) -> None:
    to = to or (RUNS if name in OF_RUNS else DATA)
    with (to / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
        file.write(f"# {what}{units}\n# Source: {source}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(head.split())
        writer.writerows(rows)
    print(f"{name}.csv: {len(rows)} rows")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
