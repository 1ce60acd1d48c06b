# %% [markdown]
# # First run
#
# A flexible NREL 5 MW turbine in turbulent wind: ten lines from the turbine to its
# loads.

# %%
import meltemi

turbine = meltemi.load_turbine("nrel5mw")
model = meltemi.build(turbine)
turbine

# %% [markdown]
# A wind is a short description; the turbulent field is generated for the rotor and the
# duration of the run. The simulation starts in steady operation, so that only the first
# seconds are an initial transient.

# %%
duration = 120.0  # reduced: 25.0
wind = meltemi.TurbulentWind(speed=12.0, intensity=0.14, seed=1)
result = meltemi.simulate(model, wind, duration=duration, transient=20.0)
result

# %% [markdown]
# Near rated wind speed, 11.4 m/s, the controller changes between two tasks: below it
# the torque keeps the best tip-speed ratio at a constant pitch angle, above it the
# pitch angle holds the rotor speed. The root moment is largest in between.

# %%
meltemi.plot(
    result, ["wind_x", "generator_power", "pitch_1", "rotor_speed", "RootMyc1"]
)

# %% [markdown]
# Every channel has a meltemi name and, where it exists, the name that OpenFAST gives
# it. Arrays are in SI units.

# %%
channel = result.channel("RootMyc1")
print(f"{channel.name} [{channel.unit}], {channel.frame}, {channel.sign}")
loads = meltemi.equivalent_loads(result)
print(f"damage-equivalent load {loads['root_moment_out_of_plane_1'] / 1e6:.2f} MN m")
print(f"{result.meta['real_time_factor']:.0f} times real time")

# %% [markdown]
# A run with `view=True` records the motion of the turbine, which `view` shows in three
# dimensions: drag to turn, choose loads and cameras in the panel.

# %%
meltemi.simulate(model, wind, duration=20.0, view=True).view()
