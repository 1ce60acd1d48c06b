# %% [markdown]
# # Modes and Campbell diagram
#
# Natural frequencies and damping of the operating turbine, computed from its section
# data and named by the parts that move; the Campbell diagram shows which of them the
# rotor excites.

# %%
import math

import meltemi

model = meltemi.build(meltemi.load_turbine("nrel5mw"))
for mode in meltemi.analysis.natural_modes(model)[:7]:
    print(f"{mode.frequency / math.tau:6.3f} Hz   {mode.participation()}")

# %% [markdown]
# At standstill the three blades have pairs of equal frequencies. In rotation these
# split into forward and backward whirl, apart by twice the rotor speed in the fixed
# frame. The aerodynamic damping of flapwise modes is large, that of edgewise and
# lateral tower modes small.

# %%
speeds = [4.0, 6.0, 8.0, 10.0, 12.0, 15.0, 18.0, 21.0, 24.0]  # reduced: [12.0]
diagram = meltemi.analysis.campbell(model, wind_speeds=speeds)
meltemi.plots.plot_campbell(diagram)

# %% [markdown]
# The mode shapes at standstill, one by one:

# %%
model.view()

# %%
for label, frequency, damping in zip(
    diagram.labels, diagram.frequency, diagram.damping, strict=True
):
    if damping[-1] < 0.02:
        hertz, percent = frequency[-1] / math.tau, 100.0 * damping[-1]
        print(f"{label:32s} {hertz:6.3f} Hz, damping ratio {percent:5.2f} %")
