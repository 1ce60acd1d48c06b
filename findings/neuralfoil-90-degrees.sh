#!/usr/bin/env bash
# neuralfoil 0.3.3: at 90 degrees a NACA 4412 has the drag of attached flow, and the same lift as at -90 degrees.
#
# Guess: get_aero_from_coordinates, which takes any angle, ends in flat-plate values, as AeroSandbox's method of the same
# network does: drag about 2, lift changing its sign between 90 and -90 degrees. Seen: the angle enters by functions of
# twice itself; drag 0.011 and lift 0.40 at both, 0.096 at 180. Only analysis_confidence, 0, tells: a table from -180 to 180
# degrees for blade-element theory needs an extrapolation (Viterna) beyond stall.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet neuralfoil==0.3.3 AeroSandbox==4.2.10
venv/bin/python - <<'PYTHON'
import neuralfoil as nf
import numpy as np

m, p, t = 0.04, 0.4, 0.12
x = 0.5 * (1 - np.cos(np.linspace(0, np.pi, 100)))
half = 5 * t * (0.2969 * np.sqrt(x) - 0.126 * x - 0.3516 * x**2 + 0.2843 * x**3 - 0.1036 * x**4)
camber = np.where(x < p, m / p**2 * (2 * p * x - x**2), m / (1 - p) ** 2 * ((1 - 2 * p) + 2 * p * x - x**2))
shape = np.vstack([np.c_[x, camber + half][::-1], np.c_[x, camber - half][1:]])
found = {}
for angle in (4, 90, -90, 180):
    aero = nf.get_aero_from_coordinates(shape, alpha=float(angle), Re=3e6)
    found[angle] = lift, drag, sure = [float(np.ravel(aero[key])[0]) for key in ("CL", "CD", "analysis_confidence")]
    print(f"{angle:4d} deg: lift {lift:.3f}, drag {drag:.4f}, confidence {sure:.2f}")
same = np.allclose(found[90], found[-90])
raise SystemExit(0 if same and found[90][1] < 0.05 and found[90][2] < 0.01 < found[4][2] else 1)
PYTHON
