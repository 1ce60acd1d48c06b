# %% [markdown]
# # Your own controller
#
# A controller is a Python function. This one adds a tower damper to the baseline
# controller, in plain Python first and compiled afterwards.

# %%
import numba

import meltemi

turbine = meltemi.load_turbine("nrel5mw")
model = meltemi.build(turbine)
wind = meltemi.TurbulentWind(speed=18.0, intensity=0.14, seed=3)
duration = 120.0  # reduced: 5.0
baseline = meltemi.control.BaselineController(turbine)
collective = baseline.update

# %% [markdown]
# The function is called at every sample instant. It reads the measurements, changes the
# demands, and keeps what it needs in `state`. Here the baseline law sets torque and
# pitch; then the velocity of the tower top, integrated from its acceleration with a
# leak, moves all blades: while the tower moves downwind more pitch reduces the thrust,
# which damps the motion.

# %%
own = len(baseline.state_names)  # index of our state, behind those of the baseline


def damper(state, measurements, demands, dt):
    collective(state, measurements, demands, dt)
    state[own] += dt * (measurements.fore_aft_acceleration - 0.3 * state[own])
    for blade in range(3):
        demands.pitch[blade] = max(demands.pitch[blade] + 0.06 * state[own], 0.0)


def init(start):
    return [*baseline.init(start), 0.0]


plain = meltemi.Controller(damper, init=init, name="damper")
runs = [
    meltemi.simulate(model, wind, duration=duration, controller=law)
    for law in (baseline, plain)
]

# %%
meltemi.plot(
    runs,
    ["tower_top_fore_aft", "TwrBsMyt", "pitch_1", "rotor_speed"],
    labels=["baseline", "with damper"],
)

# %% [markdown]
# Loads of both runs, and the speed of the same function when Numba compiles it:

# %%
for label, run in zip(("baseline", "with damper"), runs, strict=True):
    load = meltemi.equivalent_loads(run)["tower_base_moment_fore_aft"]
    speed = run.meta["real_time_factor"]
    print(f"{label:12s} {load / 1e6:5.1f} MN m, {speed:4.0f} times real time")
compiled = meltemi.Controller(numba.njit(damper), init=init, name="damper, compiled")
run = meltemi.simulate(model, wind, duration=duration, controller=compiled)
print(f"compiled {run.meta['real_time_factor']:19.0f} times real time")

# %% [markdown]
# The damper pays with pitch travel and rotor speed; [comparison of
# controllers](../guide/comparing.md) puts both beside each other, with intervals over
# seeds. [User-defined controllers](../guide/controllers.md) has all signals.
