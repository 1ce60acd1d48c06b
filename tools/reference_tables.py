"""Makes the small reference tables of ``meltemi verify`` from a folder of OpenFAST runs.

    python tools/reference_tables.py ../shared/reference

Only needed when the reference runs change; users never call it.
"""

from __future__ import annotations

import csv
import sys
from pathlib import Path

import numpy as np

from meltemi.postprocess.statistics import means_over_revolutions
from meltemi_verification.measure import decay, extremes, harmonic, undershoot

SOURCE = (
    "OpenFAST v5.0.0, NREL 5 MW land-based, deck of the ROSCO test cases (Apache-2.0) with the baseline controller "
    "of NREL/TP-500-38060"
)
DATA = Path(__file__).parents[1] / "src/meltemi_verification/data"
WINDS = ("4", "6", "8", "10", "11.4", "12", "13", "15", "18", "20", "22", "24")
STEADY = (
    "GenPwr RotSpeed BldPitch1 RotThrust RotTorq RotPwr RtFldFxh RootMyc1 RootMxc1 OoPDefl1 IPDefl1 TTDspFA TwrBsMyt "
    "TwrBsMxt YawBrMyp YawBrMzp"
).split()
FACTOR = {
    "kN": 1e3, "kN-m": 1e3, "kW": 1e3, "deg": np.pi / 180, "rpm": np.pi / 30, "m": 1, "N": 1, "N-m": 1, "m/s": 1,
    "rad": 1, "-": 1, "N/m": 1, "s": 1, "W": 1,
}  # fmt: skip
GUST = "Wind1VelX GenPwr RotSpeed BldPitch1 RtFldFxh RootMyc1 OoPDefl1 TTDspFA TwrBsMyt".split()
YAWED = (
    "GenPwr RotSpeed YawBrFxp YawBrFyp YawBrFzp YawBrMxp YawBrMyp YawBrMzp TwrBsFxt TwrBsFyt TwrBsMxt TwrBsMyt "
    "TwrBsMzt RootFxc1 RootFyc1 RootFzc1 RootMxc1 RootMyc1 RootMzc1"
).split()
NODES = "Alpha AxInd TnInd Cl Cd Fx Fy".split()


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


def write(name: str, what: str, head: str, rows: list[list[object]]) -> None:
    with (DATA / f"{name}.csv").open("w", newline="", encoding="utf-8") as file:
        file.write(f"# {what}; SI units\n# Source: {SOURCE}\n")
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(head.split())
        writer.writerows(rows)
    print(f"{name}.csv: {len(rows)} rows")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
