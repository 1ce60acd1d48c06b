# %% [markdown]
# # Gradients of loads
#
# One run with derivatives tells how every load changes with every parameter: controller
# gains, pitch offset, air density. The derivatives are exact, through the turbulent,
# flexible, controlled turbine.

# %%
import matplotlib.pyplot as plt
import numpy as np

import meltemi

model = meltemi.build(meltemi.load_turbine("nrel5mw"))
wind = meltemi.TurbulentWind(speed=18.0, intensity=0.14, seed=1)
duration = 120.0  # reduced: 25.0
names = [
    "controller.proportional_gain",
    "controller.integral_gain",
    "pitch_offset",
    "aerodynamics.air_density",
]
run = meltemi.analysis.sensitivity(meltemi.Run(model, wind, duration=duration), names)

# %% [markdown]
# Relative derivatives, in percent of the load for one percent of the parameter (for one
# degree of the pitch offset):

# %%
quantities = {
    "rotor speed, std": run.std("rotor_speed", skip=20.0),
    "blade root, DEL": run.fatigue("RootMyc1", 10.0, skip=20.0),
    "tower base, DEL": run.fatigue("TwrBsMyt", 4.0, skip=20.0),
    "power, mean": run.mean("generator_power", skip=20.0),
}
scale = np.array(
    [*(0.01 * np.array(run.values[:2])), np.radians(1.0), 0.01 * run.values[3]]
)
table = np.array(
    [100.0 * slope * scale / value for value, slope in quantities.values()]
)
figure, axes = plt.subplots(figsize=(8.0, 3.2), layout="constrained")
limit = np.abs(table).max()
axes.imshow(
    np.sign(table) * np.sqrt(np.abs(table)),
    cmap="RdBu_r",
    vmin=-2.0 * limit**0.5,
    vmax=2.0 * limit**0.5,
    aspect="auto",
)
for (i, j), value in np.ndenumerate(table):
    axes.text(j, i, f"{value:+.3f} %", ha="center", va="center")
axes.set_xticks(
    range(4),
    [
        "proportional gain\n+1 %",
        "integral gain\n+1 %",
        "pitch offset\n+1 deg",
        "air density\n+1 %",
    ],
)
axes.set_yticks(range(4), list(quantities))
axes.tick_params(length=0.0)
# %% [markdown]
# The same derivative by two runs with slightly different pitch offsets confirms it:

# %%
low, high, step = meltemi.analysis.finite_difference_runs(
    meltemi.Run(model, wind, duration=duration), "pitch_offset"
)
slope = (high["RootMyc1"].mean() - low["RootMyc1"].mean()) / (2.0 * step)
exact = run.mean("RootMyc1")[1][2]
print(f"mean root moment, differences  {slope / 1e6:.4f} MN m/rad")
print(f"mean root moment, derivatives  {exact / 1e6:.4f} MN m/rad")

# %% [markdown]
# [`examples/tune_pitch.py`](../guide/sensitivities.md) minimises a load with such
# gradients.
