#!/usr/bin/env bash
# PyConTurb writes and reads TurbSim files (.bts) with the vertical index fastest; the format has the lateral one fastest. On
# a square grid OpenFAST gets the field transposed: shear over the height becomes shear across the rotor.
#
# Versions: pyconturb 2.7.4, openfast_io 5.0.0 (the reader of OpenFAST's own tools; numpy 1.26.4).
# Guess: what df_to_bts writes is what OpenFAST and its tools read ("y-index, z-index, time (slowest)" in its comments).
# Seen: a wind of 10, 11, 12 m/s at three heights comes out of openfast_io as 10, 11, 12 m/s from right to left, constant over
#   the height. PyConTurb's own reader has the same order, so that its round trip looks right.
set -euo pipefail
folder=$(mktemp -d); trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numpy==1.26.4 pandas==2.2.3 scipy==1.14.1 \
  pyconturb==2.7.4 openfast_io==5.0.0
cd "$folder"
venv/bin/python - <<'PY'
import numpy as np
import pandas as pd
from openfast_io.turbsim_file import TurbSimFile
from pyconturb._utils import gen_spat_grid
from pyconturb.io import bts_to_df, df_to_bts

y, z = np.array([-10.0, 0.0, 10.0]), np.array([80.0, 90.0, 100.0])
grid = gen_spat_grid(y, z)
series = pd.DataFrame(0.0, index=0.5 * np.arange(4), columns=grid.columns)
for name in series:
    wobble = 0.01 * np.array([-1.0, 1.0, -1.0, 1.0])
    series[name] = wobble + (10.0 + (grid.loc["z", name] - 80.0) / 10.0 if name.startswith("u_") else 0.0)
df_to_bts(series, grid, "a.bts")
u = TurbSimFile("a.bts")["u"][0].mean(axis=0)  # (y, z)
print("u that was written, rows upwards from the lowest: 10, 11, 12 m/s at every y")
print("u of openfast_io, rows upwards, columns from right to left:\n", u.T.round(2))
again = bts_to_df("a.bts")
own = np.abs(again[[c for c in again if c.startswith("u_")]].mean().values - series.filter(regex="u_").mean().values).max()
print(f"PyConTurb's own reader: largest difference {own:.4f} m/s")
transposed = np.abs(u - (10.0 + np.arange(3.0)[:, None])).max() < 0.01
raise SystemExit(0 if transposed and own < 0.01 else "the behaviour has changed")
PY
