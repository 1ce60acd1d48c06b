# %% [markdown]
# # Import of an OpenFAST deck
#
# A deck becomes a turbine, with a note on the treatment of every line. The same deck
# runs as OpenFAST's model and as the more complete model of this package, so that the
# difference between both is known.

# %%
import tempfile
from pathlib import Path

import meltemi

# %% [markdown]
# This notebook has no deck of its own: it exports the turbine of the library as one.
# Put the path of your `.fst` file in place of `deck_file`, and leave `control_of` away
# if it comes with ROSCO.

# %%
ours = meltemi.load_turbine("nrel5mw")
wind = meltemi.TurbulentWind(speed=13.0, intensity=0.14, seed=2)
folder = Path(tempfile.mkdtemp())
deck_file = meltemi.io.write_openfast(
    ours, folder / "deck", wind=meltemi.SteadyWind(speed=13.0)
).main
print(*sorted(file.name for file in deck_file.parent.iterdir())[:12], sep="\n")

# %%
deck = meltemi.io.read_deck(deck_file, control_of=ours)
for note in deck.noted("approximated"):
    print(f"{note.where}: {note.what}: {note.why}")

# %% [markdown]
# ElastoDyn's blades have two flapwise modes and one edgewise mode, and no torsion.
# Geometrically exact blades with torsion twist under load.

# %%
duration = 60.0  # reduced: 5.0
models = {
    "as in ElastoDyn": meltemi.build(
        deck.turbine, meltemi.ModelOptions(**deck.options)
    ),
    "exact, with torsion": meltemi.build(deck.turbine),
}
runs = [meltemi.simulate(model, wind, duration=duration) for model in models.values()]
meltemi.plot(runs, ["RootMyc1", "OoPDefl1", "BldPitch1", "GenPwr"], labels=list(models))

# %%
found = meltemi.analysis.compare_results(
    runs[1], runs[0], ["RootMyc1", "OoPDefl1", "TwrBsMyt"]
)
for channel in found.channels:
    print(f"{channel.channel.name:28s} std {100.0 * channel.std_change:+5.1f} %")
