# %% [markdown]
# # Fault and emergency stop
#
# Faults are data: at 20 s the pitch of a blade sticks, at 27 s the grid is lost. A
# supervised controller stops the turbine with the other two blades; the result has a
# log of all events and of the reason for every transition.

# %%
import meltemi

turbine = meltemi.load_turbine("nrel5mw").replace(
    **{"pitch_actuator.kind": "second_order"}
)
model = meltemi.build(turbine)
wind = meltemi.TurbulentWind(speed=16.0, intensity=0.14, seed=5)
events = [
    meltemi.events.PitchStuck(at=20.0, blade=2),
    meltemi.events.GridLoss(at=27.0),
]
duration = 80.0  # reduced: 31.0
stopped = meltemi.simulate(
    model,
    wind,
    duration=duration,
    controller=meltemi.control.SupervisedController(turbine),
    events=events,
)
for entry in stopped.log:
    print(f"{entry.time:6.2f} s  {entry.source:10s} {entry.what} {entry.reason}")

# %%
channels = [
    "rotor_speed",
    "pitch_1",
    "pitch_2",
    "generator_power",
    "shaft_yaw_moment",
    "tower_base_moment_fore_aft",
]
meltemi.plot(stopped, channels)

# %% [markdown]
# Two blades at feather brake the rotor against the stuck one. The price is an
# imbalance: the fixed hub carries a moment that turns with the rotor, and the tower
# swings after the thrust is gone.

# %%
table = stopped.between(27.0, duration).statistics()
print(
    table.loc[
        ["rotor_speed", "shaft_yaw_moment", "tower_base_moment_fore_aft"]
    ].to_string(float_format="%.4g")
)
