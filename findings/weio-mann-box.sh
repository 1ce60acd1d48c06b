#!/usr/bin/env bash
# weio's MannBoxFile says that its first index runs against time, but writes TurbSim fields with it along time, and gives
# series and times along time: of HAWC2, which plays the last plane first, it has every box backwards.
#
# Versions: weio 2.0.0, h2lib-tests 13.2.2103 (the box and the output of HAWC2 13.0.4 in its wheel).
# Guess: MannBoxFile.valuesAt(y, z) over MannBoxFile.t(dx, U) is the wind that HAWC2 has there ("ix==1..nx corresponds to
#   it = nt..1" in its documentation), and fromTurbSim(...).write(...) a box that HAWC2 plays as TurbSim made it.
# Seen: valuesAt of the right corner has a correlation of 0.1 with HAWC2's wind there; the same box reversed in time, at the
#   corner that weio has on the left, one of 1.000. fromTurbSim writes the first step as plane 0, which t() has at time 0, too.
set -euo pipefail
folder=$(mktemp -d); trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numpy==1.26.4 h5py==3.12.1 weio==2.0.0
"$folder/venv/bin/pip" download --quiet --disable-pip-version-check --no-deps --dest "$folder" h2lib-tests==13.2.2103
cd "$folder" && python3 -m zipfile -e h2lib_tests-*.whl wheel
venv/bin/python - <<'PY'
from pathlib import Path

import h5py
import numpy as np
from weio.mannbox_file import MannBoxFile

files = Path("wheel/h2lib_tests/test_files/minimal")
with h5py.File(files / "res/minimal_mann_turb.hdf5") as f:
    hawc2 = f["block0000/data"][:, 1][3::4]  # downwind at (0, 0, 0), the right lower corner, every 0.4 s: one plane
box = MannBoxFile(str(next(files.glob("turb/*_s0001_u"))), N=(512, 32, 16), dy=3.0, dz=4.0)
n = len(hawc2)
best = {}
for side, y in (("y = -46.5 m (right)", -46.5), ("y = +46.5 m (left)", 46.5)):
    series = box.valuesAt(y=y, z=0.0)
    for name, x in (("as given", series), ("backwards", series[::-1])):
        best[side, name] = max(np.corrcoef(np.roll(x, s)[:n], hawc2)[0, 1] for s in range(-2, 3))
        print(f"valuesAt({side}), {name}: correlation with HAWC2 at its right corner {best[side, name]:.3f}")
expected = ("y = +46.5 m (left)", "backwards")
ok = best.pop(expected) > 0.9999 and max(best.values()) < 0.5

u = np.arange(3 * 8 * 2 * 2, dtype=float).reshape(3, 8, 2, 2)  # of TurbSim: component, step, y, z
MannBoxFile().fromTurbSim(u, 0).write("b.bin")
planes = np.fromfile("b.bin", "<f4").reshape(8, 2, 2)
print("plane 0 of the box written from TurbSim is step", int(planes[0].min() // 4), "of 0 to 7; HAWC2 plays planes 0, 7, 6, ...")
ok &= planes[1].min() == u[0, 1].min()
raise SystemExit(0 if ok else "the behaviour has changed")
PY
