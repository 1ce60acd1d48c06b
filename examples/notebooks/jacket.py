# %% [markdown]
# # From a jacket to the damage of its joints
#
# The NREL 5 MW turbine stands on the jacket of OC4 in 50 m of water. Which of its
# welded joints does wind with waves wear out first?

# %%
import matplotlib.pyplot as plt
import numpy as np

import meltemi
from meltemi.environment import IrregularSea
from meltemi.frames.joints.fatigue import LoadCase, joint_fatigue, largest_utilisations
from meltemi.frames.joints.picture import plot_joint_damage
from meltemi.frames.joints.settings import JointSettings
from meltemi.frames.loads import section_loads

turbine = meltemi.load_turbine("nrel5mw-jacket")
model = meltemi.build(turbine)
frame = turbine.frame
print(f"{len(frame.members)} members, {len(frame.joints)} joints")

# %% [markdown]
# Section loads at the ends and in the middle of every member are channels. A joint
# needs them all at the same instants, so every run records them all:

# %%
speeds = np.array([6.0, 10.0, 14.0, 18.0, 22.0])  # m/s
height = np.array([1.0, 1.4, 1.9, 2.7, 3.5])  # m
period = np.array([7.0, 7.2, 7.8, 8.6, 9.5])  # s
hours = 20.0 * 8766.0 * meltemi.loads.weibull_weights(speeds, 10.0, 2.0)

duration = 260.0  # reduced: 30.0
transient = 60.0  # reduced: 10.0
runs = [
    meltemi.Run(
        model,
        meltemi.wind.ntm(speed, "IB", seed=1 + i),
        sea=IrregularSea(height=height[i], period=period[i], seed=1 + i),
        duration=duration,
        transient=transient,
        channels=["member_*_force_*", "member_*_moment_*"],
    )
    for i, speed in enumerate(speeds)
]


# %% [markdown]
# The six loads of each section become hot-spot stresses at eight points around both
# sides of each weld, rainflow cycles, and by an S-N curve damage over 20 years:


# %%
def sections(result):
    """Loads (T, 6) by member and place."""
    return section_loads(frame, result.evaluated)


outcomes = meltemi.simulate_batch(runs, reduce=sections)
cases = [
    LoadCase(f"{u:g} m/s", outcome.value, duration - transient, h)
    for u, outcome, h in zip(speeds, outcomes, hours, strict=True)
]
fatigue = joint_fatigue(frame, cases)
worst = fatigue.worst.set_index("joint")
print(worst[["brace", "side", "position", "curve", "life"]].head(5).to_string())

# %%
used = largest_utilisations(frame, cases[-1].loads)
members = {}
for (member, _), (ratio, _) in used.items():
    members[member] = max(ratio, members.get(member, 0.0))
figure = plot_joint_damage(frame, worst["utilisation"].to_dict(), members)
figure

# %% [markdown]
# The crossings of the thin braces suffer most, in the splash zone, where the S-N curve
# is that of free corrosion. The members of OC4's model have the same wall everywhere;
# built jackets have thicker cans at their joints. With 40 mm at the crossings, 65 mm in
# the legs and the same loads:

# %%
legs = [name for name in frame.joints if len(name) == 2]  # A1 ... D5
crossings = [a + b + k for a, b in ("AB", "BC", "CD", "DA") for k in "1234"]
cans = dict.fromkeys(crossings, 0.040) | dict.fromkeys(legs, 0.065)
for name, settings in {
    "as modelled": JointSettings(),
    "cathodic protection everywhere": JointSettings(environment="cathodic"),
    "cans": JointSettings(cans=cans),
}.items():
    row = joint_fatigue(frame, cases, settings).worst.iloc[0]
    print(f"{name}: {row['joint']}, {row['life']:.1f} years")

# %% [markdown]
# The walls decide, as the [guide](../guide/frames.md#lives-of-the-oc4-jacket) explains.
# Which wind wears the worst crossing out?

# %%
share = fatigue.shares.loc[worst.index[0]]
figure, axes = plt.subplots(figsize=(6.0, 3.0), layout="constrained")
axes.bar(speeds, share.to_numpy(), 2.5)
axes.set(xlabel="wind speed [m/s]", ylabel=f"share of the damage of {worst.index[0]}")
axes.grid(axis="x")

# %% [markdown]
# One seed of 200 s a wind speed is an anecdote. `meltemi loads plan nrel5mw-jacket
# --standard 61400-3-1` makes the [load base](../guide/frames.md#load-bases) of a site,
# whose report has this table and this picture.
