"""Score of the observer against simulations: ``python tools/observer_page.py`` writes docs/verification/observer.md.

Nothing in the observer was chosen by the seeds.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

import meltemi
from meltemi.loads import damage_equivalent_load
from meltemi.postprocess.fatigue import usual_slope
from meltemi.report.tables import markdown_table
from meltemi.studies.observer import observer
from meltemi.studies.observer_signals import SENSORS
from meltemi.studies.preview import rotor_average
from meltemi.wind.turbulent import realised

LOADS = {
    "tower_base_moment_fore_aft": "tower base fore-aft",
    "tower_base_moment_side_side": "tower base side-to-side",
    "root_moment_out_of_plane_1": "blade root out of plane",
    "root_moment_in_plane_1": "blade root in plane",
}
SIGNALS = ("generator_speed", "generator_torque", "pitch_1", "pitch_2", "pitch_3", "azimuth", *SENSORS[1:])
TRANSIENT, SAMPLES = 60.0, 4


def noisy(model, result, seed):
    """The result with noise of the expected level on its sensors."""
    level, chance, data = meltemi.analysis.SensorNoise(), np.random.default_rng(seed), result.data.copy()
    rated = model.turbine.control.pitch.reference_speed
    for name, size in zip(SENSORS, (level.speed * rated, level.acceleration, level.acceleration), strict=True):
        data[:, result.names.index(name)] += size * chance.standard_normal(len(data))
    return replace(result, data=data)


def rotor_wind(box, turbine, time):
    """(T,) [m/s] longitudinal wind averaged over the rotor disk."""
    average = rotor_average(box, turbine.hub_height, turbine.rotor_radius)
    lead = 0.5 * box.dy * (box.velocity.shape[2] - 1)
    return np.interp((time + lead / box.speed) / box.dt, np.arange(len(average)), average)


def score(made, model, speed, seed, duration):
    """Correlation, bias and errors of one run: wind, then loads."""
    intensity = 0.16 * (0.75 * speed + 5.6) / speed
    wind = meltemi.TurbulentWind(speed=speed, intensity=intensity, seed=seed)
    box = realised(wind, model.turbine, TRANSIENT + duration)
    run = {"duration": TRANSIENT + duration, "transient": TRANSIENT, "output_step": 0.04}
    result = meltemi.simulate(model, box, channels=[*SIGNALS, *LOADS], **run)
    found = made.estimate(noisy(model, result, seed), samples=SAMPLES)
    late = found.result.time >= TRANSIENT
    truth = rotor_wind(box, model.turbine, found.result.time)[late]
    mine = found.result["rotor_effective_wind"][late]
    rows = [np.corrcoef(mine, truth)[0, 1], np.mean(mine - truth)]
    for name in LOADS:
        true = np.interp(found.result.time, result.time, result[name])[late]
        mine = found.result[name][late]
        slope = usual_slope(result.channel(name))
        series = [true, mine, *(sample[name][late] for sample in found.samples)]
        own, alone, *drawn = (damage_equivalent_load(x, duration=duration, slope=slope) for x in series)
        rows += [np.corrcoef(mine, true)[0, 1], 100.0 * (alone / own - 1.0), 100.0 * (np.mean(drawn) / own - 1.0)]
    return rows


def soft(name, speeds):
    """Wind speeds estimated in steady wind with models of flexible and of rigid blades."""
    model = meltemi.build(meltemi.load_turbine(name))
    still = model.options.replace(flap_modes=0, edge_modes=0, torsion_modes=0, residual_modes=0)
    stiff = meltemi.build(model.turbine, still)
    pair = [observer(some) for some in (model, stiff)]
    rows = []
    for speed in speeds:
        wind = meltemi.SteadyWind(speed=speed, shear_exponent=0.2)
        result = meltemi.simulate(model, wind, duration=100.0, channels=list(SIGNALS), output_step=0.04)
        rows.append([speed, *(np.mean(one.estimate(result).result["rotor_effective_wind"][-500:]) for one in pair)])
    return rows


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--turbines", default="nrel5mw,iea15mw")
    parser.add_argument("--speeds", default="6,8,10,12,14,16,18,20,22,24")
    parser.add_argument("--seeds", default="201,202,203")
    parser.add_argument("--duration", type=float, default=600.0)
    parser.add_argument("--soft", default="nrel5mw,iea15mw,iea22mw")
    parser.add_argument("--out", type=Path, default=Path("docs/verification/observer.md"))
    given = parser.parse_args()
    speeds, seeds = ([float(x) for x in given.speeds.split(",")], [int(x) for x in given.seeds.split(",")])
    ran = {"SPEEDS": given.speeds.replace(",", ", "), "SEEDS": given.seeds.replace(",", ", ")}
    ran |= {"DURATION": f"{given.duration:g}", "SAMPLES": str(SAMPLES), "TRANSIENT": f"{TRANSIENT:g}"}
    text = (Path(__file__).parent / "observer_page.md").read_text().rstrip()
    for word, value in ran.items():
        text = text.replace(word, value)
    lines = text.splitlines()
    head = ["wind m/s", "wind corr.", "bias m/s", *(f"{words}" for words in LOADS.values())]
    for name in filter(None, given.turbines.split(",")):
        model = meltemi.build(meltemi.load_turbine(name))
        made = observer(model)
        all_rows, rows = [], []
        for speed in speeds:
            runs = np.array([score(made, model, speed, seed, given.duration) for seed in seeds])
            all_rows.append(runs)
            print(name, speed, np.round(runs.mean(axis=0), 3), flush=True)
            rows.append([f"{speed:g}", *cells(runs)])
        runs = np.concatenate(all_rows)
        rows += [["all", *cells(runs)], *extremes(runs)]
        lines += ["", f"## {model.turbine.name}", "", *markdown_table(head, rows)]
    lines += [
        "",
        "## Flexible and rigid blades",
        "",
        (Path(__file__).parent / "observer_soft.md").read_text().strip(),
        "",
    ]
    rows = []
    for name in filter(None, given.soft.split(",")):
        for speed, mine, stiff in soft(name, (7.0, 9.0, 11.5, 16.0, 22.0)):
            print(name, speed, mine, stiff, flush=True)
            shift = f"{100.0 * (stiff / speed - 1.0):+.1f} %"
            rows.append([name, f"{speed:g}", f"{mine:.2f}", f"{stiff:.2f}", shift])
    lines += markdown_table(["turbine", "wind m/s", "flexible model m/s", "rigid blades m/s", "error rigid"], rows)
    given.out.write_text("\n".join(lines) + "\n")


def cells(runs):
    """Means over runs: correlation, bias; of each load correlation and DEL errors, signed / magnitude."""
    loads = [
        f"{np.mean(c):.3f}; {np.mean(alone):+.1f} / {np.mean(abs(alone)):.1f} %; "
        f"{np.mean(drawn):+.1f} / {np.mean(abs(drawn)):.1f} %"
        for c, alone, drawn in runs[:, 2:].T.reshape(-1, 3, len(runs))
    ]
    return [f"{runs[:, 0].mean():.3f}", f"{runs[:, 1].mean():+.2f}", *loads]


def extremes(runs):
    """Rows of the lowest correlation with the largest magnitudes, and of the runs with errors above 10 %."""
    loads = runs[:, 2:].T.reshape(-1, 3, len(runs))
    worst = [f"{c.min():.3f}; {abs(alone).max():.1f} %; {abs(drawn).max():.1f} %" for c, alone, drawn in loads]
    above = [f"{np.sum(abs(alone) > 10.0)}; {np.sum(abs(drawn) > 10.0)}" for _, alone, drawn in loads]
    wind = [f"{runs[:, 0].min():.3f}", f"{runs[np.argmax(abs(runs[:, 1])), 1]:+.2f}"]
    return [["worst run", *wind, *worst], [f"above 10 %, of {len(runs)}", "", "", *above]]


if __name__ == "__main__":
    main()
