# %% [markdown]
# # From a metocean table to the fatigue of a pile
#
# A table of a site says how wind and waves come together. Which of them wears the pile
# of a 15 MW turbine out, in which wind, and what do waves from the side add?

# %%
import matplotlib.pyplot as plt
import numpy as np

import meltemi
from meltemi.environment import IrregularSea

# %% [markdown]
# Wind speeds with significant wave height and period of the peak, and the directions of
# the waves against the wind with their shares of the time (invented; `meltemi loads
# metocean` prints published sites):

# %%
speeds = np.array([4.0, 8.0, 12.0, 16.0, 20.0, 24.0])  # m/s
height = np.array([0.8, 1.1, 1.6, 2.3, 3.1, 3.9])  # m
period = np.array([7.0, 7.0, 7.4, 8.2, 9.1, 9.9])  # s
misalignment, share = np.radians([0.0, 60.0]), np.array([0.7, 0.3])
wind_share = meltemi.loads.weibull_weights(speeds, 10.0, 2.0)

# %%
duration = 660.0  # reduced: 70.0
channels = ["mudline_reaction_moment_x", "mudline_reaction_moment_y"]
model = meltemi.build(meltemi.load_turbine("iea15mw-monopile"))
slope, angles = 4.0, np.radians(np.arange(0.0, 180.0, 10.0))


def equivalent(result):
    """Equivalent range of the moment about axes at all angles, 0: fore-aft [N m]."""
    x, y = (result.evaluated[name] for name in channels)
    return [
        meltemi.loads.damage_equivalent_load(
            np.sin(a) * x + np.cos(a) * y, duration=duration - 60.0, slope=slope
        )
        for a in angles
    ]


runs = [
    meltemi.Run(
        model,
        meltemi.wind.ntm(speeds[i], "IB", seed=1 + i),
        sea=IrregularSea(height=h, period=period[i], direction=turn, seed=1 + i),
        duration=duration,
        transient=60.0,
        channels=channels,
        name=f"{speeds[i]:g} m/s, waves {h:g} m, {np.degrees(turn):.0f} deg",
    )
    for i in range(len(speeds))
    for h, turn in ((0.01, 0.0), *((height[i], turn) for turn in misalignment))
]
outcomes = meltemi.simulate_batch(runs, reduce=equivalent)

# %% [markdown]
# Each run is reduced to the equivalent range of the bending moment at the mudline (S-N
# slope 4, 1 Hz) in every direction around the pile. The shares of wind and misalignment
# weigh them over the lifetime:

# %%
loads = np.array([each.value for each in outcomes]).reshape(len(speeds), 3, len(angles))
calm = loads[:, 0] ** slope
sea = np.tensordot(loads[:, 1:] ** slope, share, (1, 0))
damage = {"wind alone": calm, "wind and waves": sea}
damage = {name: wind_share[:, None] * each for name, each in damage.items()}
for name, each in damage.items():
    lifetime = each.sum(axis=0) ** (1.0 / slope) / 1e6
    worst = np.degrees(angles[lifetime.argmax()])
    print(
        f"{name:15s} {lifetime.max():6.1f} MN m at {worst:.0f} deg,"
        f" {lifetime[0]:6.1f} fore-aft, {lifetime[9]:6.1f} side to side"
    )

# %%
figure, axes = plt.subplots(1, 2, figsize=(10.0, 3.4), layout="constrained")
whole = damage["wind and waves"][:, 0].sum()
for side, (name, each) in zip((-0.7, 0.7), damage.items(), strict=True):
    axes[0].bar(speeds + side, each[:, 0] / whole, 1.3, label=name)
axes[0].set(xlabel="wind speed [m/s]", ylabel="damage fore-aft [-]")
axes[0].legend()
for i, name in enumerate(("waves along the wind", "waves 60 deg from it"), start=1):
    axes[1].plot(speeds, loads[:, i, 9] / 1e6, "o-", label=name)
axes[1].plot(speeds, loads[:, 0, 9] / 1e6, "k--", label="no waves")
axes[1].set(
    xlabel="wind speed [m/s]", ylabel="side-to-side DEL [MN m]", ylim=(0.0, None)
)
axes[1].legend()

# %% [markdown]
# Near rated wind, where the thrust is largest, most of the damage arises; waves add a
# tenth to the equivalent range, and so half to the damage. The rotor hardly damps to
# the side, so waves from there weigh more than their share. One seed a condition is an
# anecdote: `meltemi loads plan iea15mw-monopile --standard 61400-3-1` makes the
# [load base](../guide/load-case-tables.md#turbines-at-sea) of a site.
