# %% [markdown]
# # Measured against simulated
#
# The measurement comes from a turbine whose blades stand one degree off, in turbulent
# wind, with a sonic anemometer at the hub. The simulation knows nothing of the offset.

# %%
from pathlib import Path

import numpy as np

import meltemi
from meltemi.validation.channel_map import ChannelMap
from meltemi.validation.comparison import Comparison
from meltemi.validation.fit import fitted
from meltemi.validation.measurements import measurements_of
from meltemi.validation.plots import plot_agreement
from meltemi.validation.settings import Validation
from meltemi.validation.simulations import Simulator, simulate_records

turbine = meltemi.load_turbine("nrel5mw")
model = meltemi.build(turbine)
offsets = {f"actuators.pitch_offset_{blade}": np.radians(1.0) for blade in (1, 2, 3)}
truth = model.with_parameters(**offsets)
length = 600.0  # reduced: 330.0
speeds = [7.0, 8.0, 9.0, 10.0]  # reduced: [8.0]
measured = ["rotor_speed", "generator_power", "root_moment_flap_1"]
columns: dict[str, list] = {}
for k, speed in enumerate(speeds):
    wind = meltemi.TurbulentWind(
        speed=speed, intensity=0.12, coherent="all", seed=100 + k
    )
    result = meltemi.simulate(
        truth,
        wind,
        duration=length + 60.0,
        channels=["wind_x", "wind_y", "wind_z", *measured],
        output_step=0.1,
    )
    part = result.between(60.0, 59.95 + length)
    columns.setdefault("t", []).append(1.7e9 + 600.0 * k + part.time - 60.0)
    for name in part.names:
        columns.setdefault(name, []).append(part[name])

# %% [markdown]
# A channel map says which column is which. Times are seconds since 1970; each record
# has ten minutes.

# %%
sonic = {"unit": "m/s", "kind": "sonic", "height": turbine.hub_height}
channels = ChannelMap(
    wind="u",
    loggers={
        "logger": {
            "time": {"column": "t", "form": "posix"},
            "channels": {
                "u": sonic | {"column": "wind_x", "component": "u"},
                "v": sonic | {"column": "wind_y", "component": "v"},
                "w": sonic | {"column": "wind_z", "component": "w"},
                "rotor_speed": {"column": "rotor_speed", "unit": "rad/s"},
                "generator_power": {"column": "generator_power", "unit": "W"},
                "root_moment_flap_1": {
                    "column": "root_moment_flap_1",
                    "unit": "N m",
                    "kind": "gauge",
                },
            },
        }
    },
)
table = {name: np.concatenate(parts) for name, parts in columns.items()}
records = measurements_of({"logger": table}, channels)
[record.file for record in records]

# %% [markdown]
# Each record is simulated in three wind fields that pass through the sonic's series.

# %%
settings = Validation(case="nrel5mw", channels=channels, seeds=3)
steady = {"kind": "steady", "speed": 8.0}
case = meltemi.io.LoadCase(turbine="nrel5mw", wind=steady, duration=60.0)
simulator = Simulator.of(settings, case, Path())
compared, _ = simulate_records(simulator, records, measured)
comparison = Comparison(tuple(compared), tuple(measured))
for each in comparison.agreements():
    if each.statistic in ("mean", "std", "DEL, m = 10"):
        print(
            f"{each.channel:20s} {each.statistic:12s} {100.0 * each.bias:+5.1f} %, "
            f"resolvable {100.0 * each.resolvable:4.1f} %: {each.verdict}"
        )
plot_agreement(comparison, [(name, "mean") for name in measured])

# %% [markdown]
# Which parameter explains a deviation? The derivatives of the run tell, and a fit with
# priors finds the degree.

# %%
prepared = [simulator.prepared(record, measured) for record in records]
posterior = fitted(simulator, prepared, comparison, ["pitch_offset", "drag"])
found = zip(
    posterior.parameters,
    posterior.estimate,
    posterior.half,
    posterior.evidence,
    strict=True,
)
for name, value, half, evidence in found:
    unit, factor = ("deg", 180.0 / np.pi) if name == "pitch_offset" else ("%", 100.0)
    estimate = f"{factor * value:+.2f} +/- {factor * half:.2f} {unit}"
    print(f"{name:14s} {estimate}, ln evidence {evidence:+.1f}")
