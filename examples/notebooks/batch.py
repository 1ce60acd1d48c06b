# %% [markdown]
# # Batch with damage-equivalent loads
#
# Wind speeds times seeds on all cores, each reduced to its loads; weights of the wind
# speed turn them into the load of a lifetime.

# %%
import matplotlib.pyplot as plt
import numpy as np

import meltemi

turbine = meltemi.load_turbine("nrel5mw")
model = meltemi.build(turbine)
speeds = np.arange(4.0, 25.0, 2.0)  # reduced: np.array([8.0, 16.0])
seeds, duration = (1, 2, 3), 320.0  # reduced: (1,), 25.0
winds = [meltemi.wind.ntm(speed, "IB", seed=seed) for speed in speeds for seed in seeds]
cases = [meltemi.Run(model, wind, duration=duration, transient=20.0) for wind in winds]
outcomes = meltemi.simulate_batch(cases, reduce=meltemi.equivalent_loads)
print(len(outcomes), "runs,", {outcome.status.name for outcome in outcomes})

# %% [markdown]
# The edgewise load comes from gravity and hardly depends on the wind; flapwise and
# tower loads rise with it.

# %%
shown = {
    "blade root, flapwise": ("root_moment_flap_1", 10.0),
    "blade root, edgewise": ("root_moment_edge_1", 10.0),
    "tower base, fore-aft": ("tower_base_moment_fore_aft", 4.0),
}
figure, axes = plt.subplots(1, 3, figsize=(9.0, 3.2), layout="constrained")
axes[0].set_ylabel("DEL, 1 Hz [MN m]")
for ax, (title, (name, slope)) in zip(axes, shown.items(), strict=True):
    loads = np.array([outcome.value[name] for outcome in outcomes])
    loads = loads.reshape(len(speeds), len(seeds))
    ax.plot(speeds, loads / 1e6, ".", color="#9aa5ae")
    means = (loads**slope).mean(axis=1) ** (1.0 / slope)
    ax.plot(speeds, means / 1e6, color="#0b6e99")
    lifetime = meltemi.loads.lifetime_del(speeds, means, slope=slope, mean_speed=10.0)
    ax.axhline(lifetime / 1e6, color="#e08a00", linestyle="--")
    ax.set_title(f"{title}\nlifetime {lifetime / 1e6:.2f} MN m")
    ax.set(xlabel="wind speed [m/s]", ylim=(0.0, None))
    ax.grid(alpha=0.4)

# %% [markdown]
# All [design load cases](../guide/load-base.md) of the standard are one command:
# `meltemi loads plan`.
