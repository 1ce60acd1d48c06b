# %% [markdown]
# # Power curve and annual energy
#
# Steady operation at any wind speed takes a fraction of a second: power, thrust, pitch,
# and the energy of a year.

# %%
import matplotlib.pyplot as plt
import numpy as np

import meltemi

model = meltemi.build(meltemi.load_turbine("nrel5mw"))
speeds = np.arange(3.0, 25.5, 1.0)  # reduced: np.array([8.0, 12.0])
points = [meltemi.operating_point(model, speed) for speed in speeds]
meltemi.plots.plot_power_curve(points)

# %% [markdown]
# An operating point has every channel of a simulation. The thrust and the deflection of
# the blade tip have their maximum at rated wind speed, where the pitch angle begins to
# rise.

# %%
thrust = np.array([point["rotor_aero_thrust"] for point in points])
tip = np.array([point["OoPDefl1"] for point in points])
print(f"largest thrust {thrust.max() / 1e3:.0f} kN at {speeds[thrust.argmax()]:g} m/s")
print(f"tip deflection {tip.max():.2f} m there, {tip[-1]:.2f} m at {speeds[-1]:g} m/s")

# %% [markdown]
# Weibull weights of the wind speed give the energy of a year: 8760 hours times the mean
# power.

# %%
power = np.array([point["generator_power"] for point in points])
means = np.linspace(6.0, 10.0, 9)
energy = [
    8760e-9 * power @ meltemi.loads.rayleigh_weights(speeds, mean) for mean in means
]
figure, axes = plt.subplots(figsize=(7.0, 3.2), layout="constrained")
axes.plot(means, energy, "o-", color="#0b6e99")
axes.set(
    xlabel="annual mean wind speed [m/s]",
    ylabel="annual energy [GWh]",
    ylim=(0.0, None),
)
axes.grid(alpha=0.4)
