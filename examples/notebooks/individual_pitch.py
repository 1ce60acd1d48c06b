# %% [markdown]
# # Individual pitch control
#
# Wind shear and turbulence load each blade once per revolution. Pitching every blade by
# itself removes this part of the load: its spectrum shows what is gained, and the pitch
# travel what it costs.

# %%
import math

import meltemi

turbine = meltemi.load_turbine("nrel5mw").replace(
    **{"pitch_actuator.kind": "second_order"}
)
model = meltemi.build(turbine)
duration = 320.0  # reduced: 75.0
wind = meltemi.TurbulentWind(speed=18.0, intensity=0.14, shear_exponent=0.2, seed=1)

# %% [markdown]
# A harmonic loop integrates the 1P part of the root moments and turns it into pitch;
# `offset` compensates the lag between pitch and moment. `tune_ipc` would choose both
# from the turbine's linear model.

# %%
loop = meltemi.control.HarmonicLoop(
    harmonic=1, integral_gain=math.radians(0.4) / 1190e3, offset=math.radians(30.0)
)
settings = meltemi.control.LoadControl(
    loops=(loop,), notch=meltemi.control.SpeedNotch(frequency=10.55)
)
runs = {}
for name, parts in {
    "collective": meltemi.control.LoadControl(notch=settings.notch),
    "individual": settings,
}.items():
    law = meltemi.control.LoadController(turbine, parts)
    runs[name] = meltemi.simulate(
        model, wind, duration=duration, controller=law
    ).between(20.0, duration)
meltemi.plots.plot_spectra(
    {name: [run] for name, run in runs.items()}, "RootMyc1"
).figure

# %% [markdown]
# The peak at 1P, 0.2 Hz, is gone. The other harmonics remain, and so does most of the
# slow part, which follows the wind.

# %%
for name, run in runs.items():
    root = meltemi.equivalent_loads(run)["root_moment_out_of_plane_1"] / 1e6
    travel = math.degrees(meltemi.loads.actuator_travel(run, "pitch_1"))
    print(f"{name:11s} DEL {root:5.2f} MN m   pitch travel {travel:5.2f} deg/s")

# %%
some = [
    run.between(100.0, 160.0) if run.time[-1] > 160.0 else run for run in runs.values()
]
meltemi.plot(some, ["RootMyc1", "pitch_1"], labels=list(runs))
