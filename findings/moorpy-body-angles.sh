#!/usr/bin/env bash
# MoorPy and MoorDyn turn a body of one and the same MoorDyn file differently: with two angles or more, a point that is
# fixed to the body is elsewhere.
#
# Versions: MoorPy 1.3.0, moordyn 2.7.2 (MoorDyn-C; numpy 1.26.4).
# Guess: MoorPy writes MoorDyn files (System.unload), so r0, p0, y0 of BODIES mean the same to both.
# Seen: a point at x = 10 m on a body at (0, 0, -20) m with r0 = 90, y0 = 90 deg is at (0, 10, -20) m in MoorPy, whose order
#   is Rz Ry Rx, and at (0, 0, -10) m in MoorDyn, whose order is Rx Ry Rz: yaw first, about the body's axis. With one
#   angle both agree. MoorPy also writes the option "depth", which MoorDyn-C does not know ("Unrecognized option").
set -euo pipefail
folder=$(mktemp -d); trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check numpy==1.26.4 MoorPy==1.3.0 moordyn==2.7.2
cd "$folder"
cat > place.py <<'PY'
import sys

import moordyn
import moorpy
import numpy as np

angles = [float(word) for word in sys.argv[1:]]
system = moorpy.System(depth=200.0)
system.addBody(1, np.array([0.0, 0.0, -20.0, *np.radians(angles)]))
system.setLineType(100.0, material="chain", name="chain")
system.addPoint(1, [0.0, 0.0, 0.0])
system.bodyList[0].attachPoint(1, [10.0, 0.0, 0.0])
system.addPoint(1, [300.0, 0.0, -200.0])
system.addLine(400.0, "chain", nSegs=10, pointA=2, pointB=1)
system.initialize()
system.unload("lines.txt")
simulation = moordyn.Create("lines.txt")
moordyn.Init(simulation, [], [])
place = moordyn.GetPointPos(moordyn.GetPoint(simulation, 1))
row = next(line for line in open("lines.txt") if line.split()[1:2] == ["fixed"])
print("RESULT BODIES", " ".join(row.split()[2:8]), "| MoorPy", *np.round(system.pointList[0].r, 3) + 0.0,
      "| MoorDyn", *np.round(place, 3) + 0.0)
print("RESULT unit error", float(np.abs(np.array(place) - system.pointList[0].r).max()))
PY
for angles in "90 0 0" "0 90 0" "0 0 90" "90 0 90"; do
  venv/bin/python place.py $angles > "out of $angles.txt" 2>&1
  grep RESULT "out of $angles.txt"
done
for angles in "90 0 0" "0 90 0" "0 0 90"; do grep -q "unit error [0-9.]*e-\|unit error 0.0" "out of $angles.txt"; done
grep -q "MoorPy 0.0 10.0 -20.0 | MoorDyn 0.0 0.0 -10.0" "out of 90 0 90.txt"
