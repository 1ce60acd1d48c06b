#!/usr/bin/env bash
# lacbox 0.4.0 (DTU's course tools for HAWC2, MIT), numpy 2.2.6: load_st reads an st file of fully populated matrices
# (FPM 1, 30 columns) as a classical one (19 columns) and says nothing.
#
# The columns behind the radii of gyration are others: pitch, x_e, y_e and 21 stiffnesses. load_st names the first 19 of
# the 30 as those of the classical beam and drops 11: "x_sh" is the structural pitch, "y_sh" is x_e, "E" is y_e, "G" is
# K11, "I_y" is K13. save_st writes these 19 columns back, a file that HAWC2 would read as a classical beam.
#
# Seen:
#   30 columns in the file, load_st returns 19
#   pitch 7 as x_sh = 7; x_e 0.25 as y_sh = 0.25; y_e -0.05 as E = -0.05; K11 1e8 as G = 1e+08
#   columns that save_st writes: 19
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
python3 -m venv "$work/venv"
"$work/venv/bin/pip" install -q --no-deps lacbox==0.4.0 numpy==2.2.6 h5py==3.14.0 pandas==2.3.1 python-dateutil==2.9.0.post0 \
    pytz==2025.2 tzdata==2025.2 six==1.17.0 scipy==1.15.3
cat > "$work/see.py" <<'P'
from pathlib import Path
import sys

from lacbox.io import load_st, save_st

folder = Path(sys.argv[1])
K = [1e8, 0, 0, 0, 0, 0, 2e8, 0, 0, 0, 0, 3e9, 0, 0, 0, 4e8, 0, 0, 5e8, 0, 6e7]  # rows of the upper triangle
row = [100.0, 0.1, 0.0, 0.3, 0.9, 7.0, 0.25, -0.05, *K]
text = "1 number of sets\n#1\n$1 2\n" + "".join(" ".join(map(str, [r, *row])) + "\n" for r in (0.0, 10.0))
(folder / "fpm.st").write_text(text)
read = load_st(folder / "fpm.st")[0][0]
print(f"{1 + len(row)} columns in the file, load_st returns {len(read)}")
print(
    f"pitch 7 as x_sh = {read['x_sh'][0]:g}; x_e 0.25 as y_sh = {read['y_sh'][0]:g}; "
    f"y_e -0.05 as E = {read['E'][0]:g}; K11 1e8 as G = {read['G'][0]:g}"
)
save_st(folder / "saved.st", read)
width = len((folder / "saved.st").read_text().splitlines()[-1].split())
print(f"columns that save_st writes: {width}")
same = (read["x_sh"][0], read["y_sh"][0], read["E"][0], read["G"][0]) == (7.0, 0.25, -0.05, 1e8)
sys.exit(0 if same and len(read) == width == 19 else 1)
P
"$work/venv/bin/python" "$work/see.py" "$work"
