# %% [markdown]
# # A row of turbines in wakes
#
# Three turbines, one behind the other, share one turbulent wind. What do the wakes
# cost, and does it help to turn the first turbine?

# %%
import matplotlib.pyplot as plt
import numpy as np

import meltemi

positions = [(0.0, 0.0), (630.0, 0.0), (1260.0, 0.0)]
wind = meltemi.TurbulentWind(speed=9.0, intensity=0.08, seed=2)
duration = 660.0  # reduced: 70.0
channels = (
    "wind_x",
    "generator_power",
    "root_moment_out_of_plane_1",
    "tower_base_moment_fore_aft",
)
results = {}
for name, wakes, yaw in (
    ("no wakes", "none", 0.0),
    ("in the wakes", "fast.farm", 0.0),
    ("first turned by 20 deg", "fast.farm", np.radians([20.0, 0.0, 0.0])),
):
    farm = meltemi.Farm("nrel5mw", positions, wakes=wakes, yaw=yaw)
    results[name] = meltemi.simulate_farm(
        farm, wind, duration=duration, transient=60.0, channels=channels
    )
    power = [
        each.evaluated["generator_power"].mean() / 1e6
        for each in results[name].turbines
    ]
    print(f"{name:24s}", *(f"{p:5.2f}" for p in power), f"  sum {sum(power):5.2f} MW")

# %% [markdown]
# The same wind costs twice: less power, and more fatigue for the turbines behind. The
# turned turbine pushes its wake aside and gives up power of its own.

# %%
figure, axes = plt.subplots(1, 3, figsize=(10.0, 3.2), layout="constrained")
loads = ("root_moment_out_of_plane_1", "tower_base_moment_fore_aft")
for i, (name, result) in enumerate(results.items()):
    place, color = np.arange(3) + 0.27 * (i - 1), ("#9aa5ae", "#0b6e99", "#e08a00")[i]
    data = [each.evaluated for each in result.turbines]
    axes[0].bar(
        place,
        [each["generator_power"].mean() / 1e6 for each in data],
        0.25,
        color=color,
        label=name,
    )
    for ax, load in zip(axes[1:], loads, strict=True):
        found = [meltemi.equivalent_loads(each, [load])[load] / 1e6 for each in data]
        ax.bar(place, found, 0.25, color=color)
for ax, title in zip(
    axes, ("power [MW]", "blade root DEL [MN m]", "tower base DEL [MN m]"), strict=True
):
    ax.set_title(title)
    ax.set_xticks(range(3), ("first", "second", "third"))
axes[0].legend(fontsize=8)

# %% [markdown]
# Seen from above at the end, with the centres of the wakes:

# %%
result = results["first turned by 20 deg"]
x, y, speed = result.view
figure, ax = plt.subplots(figsize=(10.0, 3.0), layout="constrained")
figure.colorbar(ax.pcolormesh(x, y, speed.T, shading="gouraud"), label="wind [m/s]")
for i in range(3):
    ax.plot(*result.wake(i).planes[-1][:2], "w--", linewidth=1.0)
ax.set(
    aspect="equal",
    xlabel="x [m]",
    ylabel="y [m]",
    xlim=(x[0], x[-1]),
    ylim=(y[0], y[-1]),
)

# %% [markdown]
# One seed is an anecdote: [a study](../verification/farm-control.md) has intervals over
# six, and [farms](../guide/farm.md) has all options.
