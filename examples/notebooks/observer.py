# %% [markdown]
# # Wind and loads from signals
#
# A Kalman filter estimates wind and loads from generator speed, torque, pitch and
# tower-top acceleration. A simulation provides these signals, and the true loads.

# %%
import meltemi

model = meltemi.build(meltemi.load_turbine("nrel5mw"))
observer = meltemi.analysis.observer(model)
observer

# %%
duration = 360.0  # reduced: 60.0
wind = meltemi.TurbulentWind(speed=14.0, intensity=0.16, seed=11)
result = meltemi.simulate(
    model, wind, duration=duration, transient=30.0, output_step=0.04
)
found = observer.estimate(result, samples=4)
meltemi.plots.plot_estimate(found, result)

# %% [markdown]
# The tower's moments follow the true ones. The out-of-plane moment of a blade contains
# turbulence that these signals do not show, so its band is wide. Samples of estimate
# plus error contain the missing part of the damage-equivalent load.

# %%
true, alone = meltemi.equivalent_loads(result), meltemi.equivalent_loads(found.result)
drawn = [meltemi.equivalent_loads(sample) for sample in found.samples]
for name in alone:
    if name in true:
        expected = sum(sample[name] for sample in drawn) / len(drawn)
        errors = [
            100.0 * (value / true[name] - 1.0) for value in (alone[name], expected)
        ]
        print(f"{name:30s} estimate {errors[0]:+6.1f} %   expected {errors[1]:+6.1f} %")
