# %% [markdown]
# # Turbulence
#
# A turbulent wind field is a box of velocities. Three spectral models make three kinds
# of it; its statistics are checked against what was asked for.

# %%
import matplotlib.pyplot as plt
import numpy as np

import meltemi

turbine = meltemi.load_turbine("nrel5mw")
duration = 600.0  # reduced: 60.0
fields = {
    spectrum: meltemi.wind.generate_field(
        meltemi.TurbulentWind(
            speed=12.0, intensity=0.14, spectrum=spectrum, edition=edition, seed=4
        ),
        turbine,
        duration,
    )
    for spectrum, edition in (("kaimal", 3), ("vonkarman", 2), ("mann", 3))
}

# %% [markdown]
# One instant of each field, as the rotor meets it. The circle is the rotor. Eddies of
# Mann's model are sheared by the mean wind profile, which shows in the vertical section
# along the wind below.

# %%
figure, axes = plt.subplots(2, 3, figsize=(9.0, 5.6), layout="constrained")
for (name, box), (across, along) in zip(fields.items(), axes.T, strict=True):
    _, rows, columns, _ = box.velocity.shape
    z, y = (
        box.bottom + box.dz * np.arange(rows),
        box.dy * (np.arange(columns) - (columns - 1) / 2),
    )
    u = box.velocity[:, :, :, 0]
    look = {"vmin": 6.0, "vmax": 18.0, "cmap": "viridis", "shading": "gouraud"}
    across.pcolormesh(y, z, u[0], **look)
    across.add_patch(
        plt.Circle((0.0, turbine.hub_height), 63.0, fill=False, color="white")
    )
    across.set(title=name, xlabel="across [m]", aspect="equal")
    planes = int(50.0 / box.dt)
    x = -box.speed * box.dt * np.arange(planes)
    shown = along.pcolormesh(x, z, u[:planes, :, columns // 2].T, **look)
    along.set(xlabel="along the wind [m]")
axes[0, 0].set_ylabel("height [m]")
axes[1, 0].set_ylabel("height [m]")
figure.colorbar(shown, ax=axes, label="wind speed [m/s]", shrink=0.7)
figure.align_ylabels()
# %% [markdown]
# Spectra of the field against the model: shape and variance of all three components.

# %%
target = meltemi.TurbulentWind(
    speed=12.0, intensity=0.14, spectrum="mann", edition=3, seed=4
)
meltemi.plots.plot_wind(fields["mann"], turbine, target=target)["spectra"]

# %%
for name, box in fields.items():
    found = meltemi.wind.field_statistics(box)
    hub = 100.0 * np.ravel(found.intensity[found.row, found.column])[0]
    print(f"{name:10s} mean {found.speed:.2f} m/s, intensity {hub:.1f} %")
