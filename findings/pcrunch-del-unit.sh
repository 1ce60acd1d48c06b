#!/usr/bin/env bash
# pCrunch 2.1.5 (and fatpack 0.7.8) gives a periodic load another damage equivalent load in MN than in N.
#
# Guess: a DEL has the unit of its load. fatpack sorts the extremes into classes of the load, so that all cycles of a
# periodic load have the very same range; its find_range_count then has a histogram of one value, which NumPy makes from
# half a unit below to half a unit above, whatever the unit. Seen, for a sine of 3 kN with a period of 10 s over 600 s,
# m = 4, DEL at 1 Hz over the amplitude, by hand 2 (1/10)^(1/4) = 1.1247: 1.1247 in N, 1.1256 in kN, 2.06 in MN.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet pCrunch==2.1.5 fatpack==0.7.8
venv/bin/python - <<'PYTHON'
import numpy as np
from pCrunch.fatigue import FatigueParams

t = np.arange(0.0, 600.0, 0.1)
fatigue = FatigueParams(slope=4, S_intercept=1e9)
seen = {}
for unit, amplitude in (("N", 3000.0), ("kN", 3.0), ("MN", 0.003)):
    equivalent = fatigue.compute_del(amplitude * np.sin(2 * np.pi * t / 10.0), 600.0)
    seen[unit] = float(equivalent / amplitude)
print("DEL over amplitude:", {unit: round(ratio, 4) for unit, ratio in seen.items()}, "by hand", round(2 * 0.1**0.25, 4))
raise SystemExit(0 if abs(seen["N"] - 2 * 0.1**0.25) < 1e-3 and 1.8 < seen["MN"] / seen["N"] < 1.9 else 1)
PYTHON
