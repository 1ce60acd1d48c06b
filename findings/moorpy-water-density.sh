#!/usr/bin/env bash
# MoorPy 1.3.0 reads the water density of a MoorDyn file after it has weighed the lines with another.
#
# Guess: the lines weigh what they weigh in MoorDyn, in the water of the file. A MoorDyn file gives its line types
# first and its options, with the water density, last; MoorPy takes the weight in water, from mass and diameter, at the
# line types, with 1025 kg/m3 and 9.81 m/s2, and does not take it again. Seen: of a rope of 40 kg/m and 0.2 m in fresh
# water of 1000 kg/m3, the System has rho 1000 and the rope 76.5 N/m in place of 84.2 N/m: 9 % less. The density by
# MoorDyn's other name, rhoW, is not read at all, and written out again beside a second density.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet moorpy==1.3.0
cat > lake.dat <<'FILE'
MoorDyn input file: a rope in a lake
---------------------- LINE TYPES ----------------------
Name   Diam  MassDen  EA     BA/-zeta  EI       Cd   Ca   CdAx  CaAx
(-)    (m)   (kg/m)   (N)    (N-s/-)   (N-m^2)  (-)  (-)  (-)   (-)
rope   0.2   40.0     1.0e8  -1.0      0.0      1.6  1.0  0.05  0.0
---------------------- POINTS ----------------------
ID   Attachment  X    Y    Z     M     V      CdA    CA
(#)  (-)         (m)  (m)  (m)   (kg)  (m^3)  (m^2)  (-)
1    Fixed       500  0    -100  0     0      0      0
2    Coupled     10   0    -10   0     0      0      0
---------------------- LINES ----------------------
ID   LineType  AttachA  AttachB  UnstrLen  NumSegs  Outputs
(#)  (-)       (-)      (-)      (m)       (-)      (-)
1    rope      1        2        515       20       p
---------------------- OPTIONS ----------------------
1000  rho
100   WtrDpth
---------------------- OUTPUTS ----------------------
FairTen1
--------------------- need this line ----------------------
FILE
sed "s/ rho\$/ rhoW/" lake.dat > rhow.dat
venv/bin/python - <<'PYTHON'
from math import pi

import moorpy

lake, other = moorpy.System(file="lake.dat"), moorpy.System(file="rhow.dat")
other.unload("out.dat")
weight = {rho: 9.81 * (40.0 - pi / 4 * 0.2**2 * rho) for rho in (1000.0, 1025.0)}
seen = lake.lineTypes["rope"]["w"]
written = [line.split() for line in open("out.dat") if "rho" in line]
print(f"System: {lake.rho:g} kg/m3; rope {seen:.2f} N/m; by hand {weight[1000.0]:.2f} at 1000, {weight[1025.0]:.2f} at 1025")
print(f"with rhoW: {other.rho:g} kg/m3; written again: {written}")
as_seen = lake.rho == 1000.0 and abs(seen - weight[1025.0]) < 1e-3 and other.rho == 1025.0 and len(written) == 2
raise SystemExit(0 if as_seen else 1)
PYTHON
