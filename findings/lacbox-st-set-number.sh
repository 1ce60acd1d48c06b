#!/usr/bin/env bash
# lacbox 0.4.0 (DTU's course tools for HAWC2, MIT), numpy 2.2.6: load_st counts sets and subsets from 0, load_pc from 1.
#
# The docstrings of both functions say "extract only a single set (first set is 1)". load_pc(path, dset=1) is the first
# set. load_st(path, dset=1, dsubset=1) is set #2, subset $2: no error, other stiffness than that of `set 1 1` in the
# htc file, which counts from 1. With dset=None, dsubset=1 it is not the subset of every set either, but set #2.
#
# Seen:
#   load_st(st, dset=1, dsubset=1): mass 22, the file's #1 $1 has 11, its #2 $2 has 22
#   load_st(st, dsubset=1): masses [21.0, 22.0], those of set #2
#   load_pc(pc, dset=1): thickness 18, the file's first set has 18
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --no-deps lacbox==0.4.0 numpy==2.2.6 h5py==3.14.0 pandas==2.3.1 python-dateutil==2.9.0.post0 \
    pytz==2025.2 tzdata==2025.2 six==1.17.0 scipy==1.15.3
cat > "$work/see.py" <<'P'
from pathlib import Path
import sys

from lacbox.io import load_pc, load_st

folder = Path(sys.argv[1])
lines = ["2 number of sets"]
for group in (1, 2):
    lines.append(f"#{group}")
    for subset in (1, 2):
        lines.append(f"${subset} 2")
        for r in (0.0, 10.0):
            row = [r, 10 * group + subset, 0, 0, 0.3, 0.9, 0, 0, 1e10, 1e9, 0.1, 0.4, 0.2, 0.5, 0.4, 0.6, 0, 0, 0]
            lines.append(" ".join(map(str, row)))
(folder / "st.dat").write_text("\n".join(lines) + "\n")
polars = ["2"]
for thickness in (18, 24):
    polars += ["1", f"1 2 {thickness} made-up", "-180 0 0.1 0", "180 0 0.1 0"]
(folder / "pc.dat").write_text("\n".join(polars) + "\n")

one = load_st(folder / "st.dat", dset=1, dsubset=1)["m"][0]
print(f"load_st(st, dset=1, dsubset=1): mass {one:g}, the file's #1 $1 has 11, its #2 $2 has 22")
each = [subset["m"][0] for subset in load_st(folder / "st.dat", dsubset=1)]
print(f"load_st(st, dsubset=1): masses {[float(m) for m in each]}, those of set #2")
polar = load_pc(folder / "pc.dat", dset=1)[0]["tc"]
print(f"load_pc(pc, dset=1): thickness {polar:g}, the file's first set has 18")
sys.exit(0 if one == 22 and each == [21.0, 22.0] and polar == 18 else 1)
P
"$work/venv/bin/python" "$work/see.py" "$work"
