"""Tune the gains of the pitch controller by gradient, on ten minutes of turbulence.

The objective weighs speed regulation against tower load and pitch travel:

    J = 0.4 std(rotor speed) + 0.4 DEL(tower base, fore-aft, m = 4) + 0.2 travel of the blades,

each normalised by its value with the published gains, so that J = 1 there. A run with derivatives gives J and its
gradient with respect to both gains; SciPy's L-BFGS-B minimises J over the logarithms of the gains. The result is then
validated in other wind fields.

The derivatives are taken at a constant initial state of the controller. The baseline controller starts with the
integral I = pitch / (G K_I), which changes with K_I. Its effect on speed and pitch decays, but the resulting change of
the azimuth remains. Therefore the derivative with respect to I is also computed and included by the chain rule.

    python examples/tune_pitch.py --out tuned
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

import meltemi

WEIGHTS = {"rotor speed": 0.4, "tower base": 0.4, "pitch travel": 0.2}
GAINS = ("proportional_gain", "integral_gain")
CHANNELS = ("rotor_speed", "tower_base_moment_fore_aft", "pitch_1", "root_moment_out_of_plane_1", "generator_power")
SKIP = 60.0  # [s] initial transient, excluded from the objective


def parts(run: meltemi.analysis.Sensitivity) -> dict[str, tuple[float, np.ndarray]]:
    """Terms of the objective: values in SI units, and their derivatives with respect to the gains."""
    pitch, slopes = run.series("pitch_1", skip=SKIP)
    travelled = len(pitch) * run.result.meta["output_step"]
    moves = np.diff(pitch)
    return {
        "rotor speed": run.std("rotor_speed", skip=SKIP),
        "tower base": run.fatigue("tower_base_moment_fore_aft", 4.0, skip=SKIP),
        "pitch travel": (np.abs(moves).sum() / travelled, np.sign(moves) @ np.diff(slopes, axis=0) / travelled),
    }


class Tuning:
    """The objective for factors on the published gains."""

    def __init__(self, model: meltemi.Model, wind: meltemi.WindBox, duration: float) -> None:
        self.model, self.wind, self.duration = model, wind, duration
        self.published = {name: value for name, (value, _) in parts(self.run(np.zeros(2))).items()}
        self.path: list[tuple[np.ndarray, float]] = []

    def run(self, logarithms: np.ndarray) -> meltemi.analysis.Sensitivity:
        return meltemi.analysis.sensitivity(
            meltemi.Run(
                self.model,
                self.wind,
                duration=self.duration,
                controller=law(self.model, np.exp(logarithms)),
                channels=CHANNELS,
            ),
            [*(f"controller.{name}" for name in GAINS), "controller.integral"],
        )

    def __call__(self, logarithms: np.ndarray) -> tuple[float, np.ndarray]:
        run = self.run(logarithms)
        value, gradient = 0.0, np.zeros(2)
        for name, (part, slope) in parts(run).items():
            weight = WEIGHTS[name] / self.published[name]
            value += weight * part
            by_logarithm = slope * np.array(run.values)
            gradient += weight * (by_logarithm[:2] - [0.0, by_logarithm[2]])  # I is inverse to the second gain
        self.path.append((np.exp(logarithms), value))
        print(f"  factors {np.exp(logarithms).round(4)}  J = {value:.6f}  gradient {gradient.round(6)}")
        return value, gradient


def law(model: meltemi.Model, factors: np.ndarray) -> meltemi.Controller:
    """The baseline controller with factors on its gains."""
    turbine = model.turbine
    gains = {
        f"control.pitch.{name}": factor * getattr(turbine.control.pitch, name)
        for name, factor in zip(GAINS, factors, strict=True)
    }
    return meltemi.control.BaselineController(turbine.replace(**gains))


def measures(run: meltemi.Result) -> dict[str, float]:
    """Statistics of the tables, in engineering units."""
    late = run.between(SKIP, run.time[-1])
    span = late.time[-1] - late.time[0]
    rpm = late["rotor_speed"] * 30.0 / np.pi

    def fatigue(channel: str, slope: float) -> float:
        return meltemi.loads.damage_equivalent_load(late[channel], duration=span, slope=slope) / 1e6

    return {
        "rotor speed, std [rpm]": rpm.std(),
        "rotor speed, max [rpm]": rpm.max(),
        "tower base, DEL m = 4 [MN m]": fatigue("tower_base_moment_fore_aft", 4.0),
        "pitch travel [deg/s]": np.degrees(np.abs(np.diff(late["pitch_1"])).sum()) / span,
        "blade root, DEL m = 10 [MN m]": fatigue("root_moment_out_of_plane_1", 10.0),
        "power, mean [MW]": late["generator_power"].mean() / 1e6,
        "power, std [MW]": late["generator_power"].std() / 1e6,
    }


def main(arguments: list[str] | None = None) -> None:
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--out", type=Path, default=Path("tuned"))
    options.add_argument("--duration", type=float, default=600.0, help="[s] after the first minute")
    options.add_argument("--iterations", type=int, default=15)
    given = options.parse_args(arguments)
    duration = SKIP + given.duration
    turbine = meltemi.load_turbine("nrel5mw")
    model = meltemi.build(turbine)

    def wind(speed: float, seed: int) -> meltemi.WindBox:
        turbulent = meltemi.TurbulentWind(speed=speed, intensity=0.14, seed=seed)
        return meltemi.wind.generate_field(turbulent, turbine, duration)

    print("18 m/s, seed 1:")
    tuning = Tuning(model, wind(18.0, 1), duration)
    bounds = [(np.log(0.25), np.log(4.0))] * 2
    settings = {"maxiter": given.iterations, "ftol": 1e-5}
    best = minimize(tuning, np.zeros(2), jac=True, method="L-BFGS-B", bounds=bounds, options=settings)
    factors = np.exp(best.x)
    print(f"J = {best.fun:.4f} after {len(tuning.path)} runs: {best.message}")
    for name, factor in zip(GAINS, factors, strict=True):
        print(f"  {name} x {factor:.3f} = {factor * getattr(turbine.control.pitch, name):.6g}")

    given.out.mkdir(parents=True, exist_ok=True)
    rows, shown = [], None
    for speed, seed in ((18.0, 1), (18.0, 2), (14.0, 3), (22.0, 4)):
        field = wind(speed, seed)
        runs = [
            meltemi.simulate(model, field, duration=duration, controller=law(model, f), channels=CHANNELS)
            for f in (np.ones(2), factors)
        ]
        before, after = (measures(run.raise_for_status()) for run in runs)
        rows.append(f"\n| {speed:g} m/s, seed {seed} | published | tuned | change |\n|---|---|---|---|")
        rows += [
            f"| {n} | {v:.4g} | {after[n]:.4g} | {100.0 * (after[n] / v - 1.0):+.1f} % |" for n, v in before.items()
        ]
        if (speed, seed) == (18.0, 2):
            shown = runs
    (given.out / "table.md").write_text("\n".join(rows) + "\n", encoding="utf-8")
    print("\n".join(rows))
    assert shown is not None
    names = ["rotor_speed", "pitch_1", "tower_base_moment_fore_aft"]
    end = min(SKIP + 120.0, duration)
    figure = meltemi.plot([run.between(SKIP, end) for run in shown], names, labels=["published gains", "tuned gains"])
    figure.savefig(given.out / "series.png", dpi=120)


if __name__ == "__main__":
    main()
