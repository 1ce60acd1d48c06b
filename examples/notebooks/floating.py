# %% [markdown]
# # A floating turbine: from the deck to its control
#
# A deck of OpenFAST becomes a turbine; its linear model says how it answers to waves,
# and why the control of a turbine on land makes it pitch.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import meltemi
from meltemi.environment import IrregularSea
from meltemi.floating.rao import linear_operators

# %% [markdown]
# This notebook writes its deck itself; put the path of your `.fst` file in its place.

# %%
library = meltemi.load_turbine("iea15mw-volturnus")
folder = Path(tempfile.mkdtemp())
deck_file = meltemi.io.write_openfast(library, folder, time_step=0.01).main
turbine = meltemi.io.read_deck(deck_file, control_of=library).turbine
print(*sorted(path.name for path in folder.iterdir()), sep=", ")
model = meltemi.build(turbine)

# %% [markdown]
# Amplitude of pitch and of the moment at the tower base per metre of a wave, in 14 m/s
# with pitch and torque held:

# %%
found = linear_operators(model, 14.0, frequency=np.linspace(0.12, 1.6, 150))
wanted = {"platform_pitch": ("deg/m", np.degrees(1.0))}
wanted["tower_base_moment_fore_aft"] = ("MN m/m", 1e-6)
figure, axes = plt.subplots(1, 2, figsize=(9.0, 3.0), layout="constrained")
for ax, (name, (unit, factor)) in zip(axes, wanted.items(), strict=True):
    value = np.abs(found.value[:, found.channels.index(name)])
    ax.semilogy(2.0 * np.pi / found.frequency, factor * value, color="#0b6e99")
    ax.set(title=f"{name} [{unit}]", xlabel="wave period [s]")

# %% [markdown]
# Control that is as fast as the pitch of the platform feeds it: more wind from a
# forward motion, less thrust by the pitch angle, and so less damping. The control of
# the turbine on land and gains below the platform's frequency in the same wind and sea:

# %%
duration = 900.0  # reduced: 40.0
fast = turbine.replace(control=meltemi.load_turbine("iea15mw").control)
wind = meltemi.TurbulentWind(speed=14.0, intensity=0.12, seed=1)
figure, ax = plt.subplots(figsize=(9.0, 3.0), layout="constrained")
for label, each in (("control of land", fast), ("below the platform", turbine)):
    result = meltemi.simulate(
        meltemi.build(each),
        wind,
        sea=IrregularSea(height=3.0, period=9.0, seed=1),
        duration=duration,
        channels=["platform_pitch", "rotor_speed"],
    )
    pitch = np.degrees(result["platform_pitch"])
    speed = result["rotor_speed"].max() * 30.0 / np.pi
    print(f"{label:20s} pitch {pitch.std():.2f} deg, rotor up to {speed:.1f} rpm")
    ax.plot(result.time, pitch, label=label)
ax.set(xlabel="time [s]", ylabel="platform pitch [deg]")
ax.legend()

# %% [markdown]
# `meltemi rao` draws all operators, beside those of a run in white noise;
# [floating turbines](../guide/floating.md) has platforms, moorings and control, and
# [load case tables](../guide/load-case-tables.md#floating-turbines) their load base.
