"""Tune a neural controller of 113 parameters by exact derivatives of loads through the simulation.

A network of one hidden layer adds a pitch angle to the baseline controller's. It sees the error of the rotor speed, its
integral that leaks, the pitch, and velocity and acceleration of the tower top. Its output weights start at zero, which
is the baseline controller. The objective

    J = 0.5 DEL(tower base, fore-aft, m = 4) + 0.3 std(rotor speed) + 0.2 std(pitch rate),

each over its value with the baseline controller, has its derivatives by all parameters from one adjoint
(``meltemi.analysis.gradient``). SciPy's L-BFGS-B minimises the mean of J over the training seeds; the result is
simulated in seeds that it has not seen.

    python examples/tune_network.py --out tuned
"""

from __future__ import annotations

import argparse
import time
from math import tanh
from pathlib import Path

import numba
import numpy as np
from scipy.optimize import minimize

import meltemi
from meltemi.compiler import Table, number, numbers, part
from meltemi.control.baseline import BaselineController, BaselineState

INPUTS, HIDDEN = 5, 16
SCALE = 0.1  # of the weights in the search, whose first step has length 1
CHANNELS = ("rotor_speed", "pitch_1", "tower_base_moment_fore_aft", "generator_power", "root_moment_out_of_plane_1")
SKIP = 20.0  # [s] initial transient, excluded from the objective


class NetworkState(Table):
    """Baseline controller, filters and weights."""

    baseline: BaselineState = part(BaselineState, "law of torque and collective pitch", prefix="")
    set_speed: float = number("rad/s", "set-point of the generator speed")
    start_pitch: float = number("rad", "pitch at the start")
    speed_integral: float = number("rad", "state: integral of the speed error, which leaks")
    top_velocity: float = number("m/s", "state: tower-top velocity from the acceleration")
    signal: float = numbers("-", "inputs of the network", [str(i) for i in range(INPUTS)])
    hidden: float = numbers("-", "weights of the hidden layer", [str(i) for i in range(INPUTS * HIDDEN)])
    offset: float = numbers("-", "offsets of the hidden layer", [str(i) for i in range(HIDDEN)])
    output: float = numbers("-", "weights of the output", [str(i) for i in range(HIDDEN)])
    bias: float = number("-", "offset of the output")


def controller(model: meltemi.Model, weights: np.ndarray) -> meltemi.Controller:
    """Baseline controller with the network's pitch added."""
    baseline = BaselineController(model.turbine)
    law, n_hidden = baseline.update, HIDDEN

    def network(state, measurements, demands, dt):
        x = NetworkState(state)
        law(x.baseline.array, measurements, demands, dt)
        acceleration = measurements.fore_aft_acceleration
        relative = measurements.generator_speed / x.set_speed - 1.0
        x.speed_integral += dt * (relative - 0.2 * x.speed_integral)
        x.top_velocity += dt * (acceleration - 0.2 * x.top_velocity)
        x.signal[0], x.signal[1], x.signal[2] = (
            20.0 * relative,
            10.0 * x.speed_integral,
            10.0 * (demands.pitch[0] - x.start_pitch),
        )
        x.signal[3], x.signal[4] = 4.0 * x.top_velocity, 2.0 * acceleration
        wanted = x.bias
        for j in range(n_hidden):
            total = x.offset[j]
            for i in range(5):
                total += x.hidden[5 * j + i] * x.signal[i]
            wanted += x.output[j] * tanh(total)
        added = 0.03 * tanh(wanted)  # [rad]
        for b in range(3):
            demands.pitch[b] = max(demands.pitch[b] + added, 0.0)

    def init(start):
        x = NetworkState(np.zeros(len(NetworkState)))
        x.array[: len(BaselineState)] = baseline.init(start)
        x.set_speed, x.start_pitch = start.generator_speed, start.pitch
        x.array[-len(weights) :] = weights
        return x.array

    return meltemi.Controller(compiled(network, law), init=init, state_names=NetworkState.names)


_COMPILED: dict = {}


def compiled(function, law):
    """The law, compiled once."""
    return _COMPILED.setdefault(law, numba.njit(function))


PARAMETERS = [
    f"controller.{name}" for name in NetworkState.names if name.startswith(("hidden", "offset", "output", "bias"))
]


def terms(result: meltemi.Result) -> dict[str, tuple[str, float, np.ndarray]]:
    """Channel, value and derivatives by its samples of each term of the objective."""
    after = result.time >= SKIP
    step, duration = result.time[1], result.time[-1] - SKIP
    found = {}

    def put(term, channel, value, weights):
        full = np.zeros(len(result.time))
        full[after] = weights
        found[term] = channel, value, full

    tower = result["tower_base_moment_fore_aft"][after]
    put("tower base", "tower_base_moment_fore_aft", *meltemi.loads.del_weights(tower, duration=duration, slope=4.0))
    put("rotor speed", "rotor_speed", *meltemi.loads.std_weights(result["rotor_speed"][after]))
    value, weights = meltemi.loads.std_weights(np.diff(result["pitch_1"][after]) / step)
    put("pitch rate", "pitch_1", value, -np.diff(weights, prepend=0.0, append=0.0) / step)
    return found


SHARES = {"tower base": 0.5, "rotor speed": 0.3, "pitch rate": 0.2}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--turbine", default="nrel5mw")
    parser.add_argument("--speed", type=float, default=18.0, help="[m/s]")
    parser.add_argument("--duration", type=float, default=60.0, help="[s]")
    parser.add_argument("--training", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--test", type=int, nargs="+", default=[11, 12, 13, 14, 15, 16])
    parser.add_argument("--iterations", type=int, default=10)
    parser.add_argument("--out", type=Path, default=Path("tuned"))
    arguments = parser.parse_args()
    model = meltemi.build(meltemi.load_turbine(arguments.turbine))

    def run(seed: int, weights: np.ndarray) -> meltemi.Run:
        wind = meltemi.TurbulentWind(speed=arguments.speed, intensity=0.14, seed=seed)
        return meltemi.Run(
            model, wind, duration=arguments.duration, channels=CHANNELS, controller=controller(model, weights)
        )

    random = np.random.default_rng(1)
    first = np.zeros(len(PARAMETERS))
    n = INPUTS * HIDDEN
    first[:n] = random.normal(0.0, 0.5, n)  # the output weights stay zero
    reference = {s: terms(simulated(run(s, first))) for s in arguments.training}

    def objective(scaled: np.ndarray) -> tuple[float, np.ndarray]:
        weights = SCALE * scaled
        began, value, slopes = time.perf_counter(), 0.0, np.zeros(len(weights))
        for seed in arguments.training:

            def weighted(result: meltemi.Result, seed: int = seed):
                j, by = 0.0, {}
                for term, (channel, size, derivative) in terms(result).items():
                    share = SHARES[term] / reference[seed][term][1]
                    j += share * size
                    by[channel] = share * derivative
                return j, by

            found = meltemi.analysis.gradient(run(seed, weights), weighted, PARAMETERS)
            value += found.value / len(arguments.training)
            slopes += found.slopes / len(arguments.training)
        print(f"J = {value:.5f}, |dJ| = {np.linalg.norm(slopes):.2e}, {time.perf_counter() - began:.1f} s", flush=True)
        return value, SCALE * slopes

    found = minimize(objective, first / SCALE, jac=True, method="L-BFGS-B", options={"maxiter": arguments.iterations})
    arguments.out.mkdir(parents=True, exist_ok=True)
    np.savetxt(arguments.out / "weights.csv", SCALE * found.x, header="weights of the network", fmt="%.12g")
    print(f"{'seed':8s}" + "".join(f"{term:>14s}" for term in SHARES) + f"{'mean power':>14s}   network over baseline")
    ratios = []
    for seed in [*arguments.training, *arguments.test]:
        before, after = simulated(run(seed, first)), simulated(run(seed, SCALE * found.x))
        a, b = terms(before), terms(after)
        row = [b[t][1] / a[t][1] for t in SHARES]
        row.append(after["generator_power"].mean() / before["generator_power"].mean())
        if seed in arguments.test:
            ratios.append(row)
        print(
            f"{seed:<8d}" + "".join(f"{x:14.3f}" for x in row) + ("   training" if seed in arguments.training else "")
        )
    print(f"{'held out':8s}" + "".join(f"{x:14.3f}" for x in np.mean(ratios, axis=0)))


def simulated(run: meltemi.Run) -> meltemi.Result:
    """The result of a run."""
    simulation = meltemi.Simulation(run)
    simulation.advance(simulation.n_steps)
    return simulation.result()


if __name__ == "__main__":
    main()
