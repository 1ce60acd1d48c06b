# %% [markdown]
# # From a windIO file to sections, stresses and a blade
#
# A windIO file describes a blade by its plies. This page computes its sections in two
# ways, turns the fibres of the spar caps so that bending twists the blade, and asks
# what that does to its loads and its plies.

# %%
import math

import numpy as np

import meltemi
from meltemi import Stations
from meltemi.turbine import (
    blade_of_layup,
    centres_of,
    finite_element_section,
    thin_walled_section,
)
from meltemi.turbine.windio_package import windio_file

path = windio_file("IEA-15-240-RWT.yaml", "this page")  # or the path of your file
layup = meltemi.io.read_layup(path)
for layer in layup.layers[:7]:
    print(
        f"{layer.name:22s} {layer.material:20s} {1e3 * layer.thickness.at(0.3):6.1f} mm"
    )

# %% [markdown]
# The section at 30 % of the span as thin walls, in milliseconds, and by finite
# elements, which leave nothing of the linear theory out:

# %%
section = layup.section(0.3)
walls, elements = thin_walled_section(section), finite_element_section(section)
for name, model in (("thin walls", walls), ("finite elements", elements)):
    K, shear = model.stiffness, centres_of(model.stiffness, model.mass).shear
    print(
        f"{name:16s} flap {K[4, 4]:.3e}, edge {K[3, 3]:.3e}, torsion {K[5, 5]:.3e} Nm2;"
        f" shear centre at {shear[1]:.2f} m; {model.mass[0, 0]:.0f} kg/m"
    )
meltemi.plots.plot_section(elements)

# %% [markdown]
# A layup of our own: the fibres of both spar caps turn by 6 degrees towards the leading
# edge between 30 % and 80 % of the span. Bending downwind then twists the blade towards
# feather.

# %%
turn = {
    "grid": [0.0, 0.3, 0.4, 0.7, 0.8, 1.0],
    "values": [0.0, 0.0, 0.105, 0.105, 0.0, 0.0],
}
layers = [
    layer.replace(angle=turn) if layer.name.startswith("Spar_Cap") else layer
    for layer in layup.layers
]
turned = layup.replace(layers=layers)
for name, each in (("as in the file", layup), ("turned", turned)):
    F = np.linalg.inv(thin_walled_section(each.section(0.5)).stiffness)
    coupling = -F[4, 5] / math.sqrt(F[4, 4] * F[5, 5])
    print(f"{name:16s} coupling of flapwise bending and twist: {coupling:+.3f}")

# %% [markdown]
# Both layups as blades of the turbine, of which only stiffness and mass change, in the
# same turbulent wind above rated:

# %%
turbine = meltemi.load_turbine("iea15mw")
places = tuple(share * turbine.blade.length for share in (0.3, 0.5, 0.7))
channels = [
    f"station_{n}_{load}_1"
    for n in (1, 2, 3)
    for load in ("force_x", "force_y", "force_z", "moment_x", "moment_y", "moment_z")
]
duration = 360.0  # reduced: 70.0
wind = meltemi.wind.ntm(14.0, "IB", seed=1)
blades, results = {}, {}
for name, each in (("as in the file", layup), ("turned", turned)):
    blades[name] = blade_of_layup(turbine, each)
    model = meltemi.build(blades[name])
    results[name] = meltemi.simulate(
        model,
        wind,
        duration=duration,
        transient=60.0,
        stations=Stations(blade=places),
        channels=[*channels, "root_moment_flap_1", "tip_twist_1"],
    )
    part = results[name].evaluated
    load = meltemi.loads.damage_equivalent_load(
        part["root_moment_flap_1"], duration=duration - 60.0, slope=10.0
    )
    twist = np.degrees(part["tip_twist_1"].mean())
    print(
        f"{name:16s} tip twist {twist:+.2f} deg nose up,"
        f" flapwise DEL {1e-6 * load:.1f} MN m"
    )

# %% [markdown]
# The section loads become strains and stresses of every ply, and indices that are 1 at
# failure with the partial factors of IEC 61400-5:

# %%
strengths = {
    name: meltemi.loads.blade_strength(
        [results[name]], blades[name], each, factors="iec61400-5-tested"
    )
    for name, each in (("as in the file", layup), ("turned", turned))
}
for name, strength in strengths.items():
    caps = [
        x
        for x in strength.layers
        if x.layer.startswith("Spar_Cap") and x.station > 50.0
    ]
    worst = max(caps, key=lambda x: x.index)
    wrinkling = max(x.index for x in strength.panels if x.mode == "wrinkling")
    print(
        f"{name:16s} {worst.layer} at {worst.station:.0f} m: {worst.index:.2f},"
        f" {worst.mode}; wrinkling of sandwich faces {wrinkling:.2f}"
    )

# %%
meltemi.plots.plot_blade_strength(strengths["turned"], "caps turned by 6 degrees")

# %% [markdown]
# The skins of the webs are above 1: the file describes two plies at 45 degrees as one,
# and criteria for fibres do not fit such data
# ([stresses and strength](../guide/strength.md#plies-of-a-blade)). `meltemi section`
# and `meltemi stress --layup` do the same on the command line.
