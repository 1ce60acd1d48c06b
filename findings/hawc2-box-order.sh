#!/usr/bin/env bash
# HAWC2 plays the LAST plane of a turbulence box first; PyConTurb writes its boxes for HAWC2 in the order of time, so HAWC2
# plays them backwards.
#
# Versions: h2lib-tests 13.2.2103 (the box and the output of HAWC2 13.0.4 in its wheel), pyconturb 2.7.4.
# Guess: plane 0 of a box passes the turbine first, then 1, 2, as OpenFAST's InflowWind reads the same files and as
#   PyConTurb's df_to_h2turb writes a time series ("pyconturb-style turbulence dataframe to binary files for hawc2").
# Seen: with steps of one plane, HAWC2's free wind is that of planes 0, N-1, N-2, ... (plane 0 begins at center_pos0), and
#   column 0 is on the right looking downwind (+x of HAWC2 is to the left). A gust at 3 s of a 40 s series of PyConTurb
#   stands in plane 6 of 80, which HAWC2 plays at 37 s.
set -euo pipefail
folder=$(mktemp -d); trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numpy==1.26.4 pandas==2.2.3 scipy==1.14.1 h5py==3.12.1 pyconturb==2.7.4
"$folder/venv/bin/pip" download --quiet --disable-pip-version-check --no-deps --dest "$folder" h2lib-tests==13.2.2103
cd "$folder" && python3 -m zipfile -e h2lib_tests-*.whl wheel
venv/bin/python - <<'PY'
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
from pyconturb._utils import gen_spat_grid
from pyconturb.io import df_to_h2turb

# minimal_mann_turb.htc: 512 x 32 x 16 points every 2 x 3 x 4 m, 5 m/s, no mean wind (shear_format 0); center_pos0 46.5 2 -30
files = Path("wheel/h2lib_tests/test_files/minimal")
box = np.fromfile(next(files.glob("turb/*_s0001_u")), "<f4").reshape(512, 32, 16)
with h5py.File(files / "res/minimal_mann_turb.hdf5") as f:
    block = f["block0000"]
    raw = block["data"][:] * (block["gains"][:] if "gains" in block else 1.0) + (block["offsets"][:] if "offsets" in block else 0.0)
    time = float(block.attrs.get("time_start", [0])[0]) + float(block.attrs["time_step"][0]) * np.arange(len(raw))
    print("HAWC2", f.attrs["description"].decode())
vy = raw[:, 1]  # downwind, at (0, 0, 0): the corner at the smallest x (right) and the ground
at_planes = np.isclose(time / 0.4, np.round(time / 0.4), atol=1e-6)
k = np.round(time[at_planes] / 0.4).astype(int)
found = {}
for name, index in (("first plane first", k), ("last plane first", -k)):
    for side, column in (("left", -1), ("right", 0)):
        errors = [np.abs(box[(index + shift) % 512, column, 0] - vy[at_planes]).max() for shift in range(-2, 3)]
        found[name, side] = min(errors)
        print(f"{name}, column {column} at the right edge: largest difference {min(errors):.1e} m/s")
ok = found["last plane first", "right"] < 1e-6 and min(v for n, v in found.items() if n != ("last plane first", "right")) > 1.0

grid = gen_spat_grid(np.array([-10.0, 0.0, 10.0]), np.array([80.0, 90.0, 100.0]))
t = 0.5 * np.arange(80)
series = pd.DataFrame(0.0, index=t, columns=grid.columns)
series.loc[3.0, [c for c in series if c.startswith("u_")]] = 5.0  # a gust at 3 s
df_to_h2turb(series, grid, ".")
u = np.fromfile("u.bin", "<f4").reshape(80, 3, 3)
plane = int(u[:, 1, 1].argmax())
print(f"PyConTurb: gust at 3.0 s is in plane {plane}; HAWC2 plays that plane at {0.5 * (-plane % 80):.1f} s")
ok &= plane == 6
raise SystemExit(0 if ok else "the behaviour has changed")
PY
