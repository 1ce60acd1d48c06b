#!/usr/bin/env bash
# openfast_io 4.1.2 reads the table of an AeroDyn blade by position; OpenFAST 5 finds the columns by their names.
#
# Guess: openfast_io reads what OpenFAST reads. OpenFAST (AeroDyn_IO.f90, ReadBladeInputs of 5.0.0) takes the columns
# from the header, in any order, BlCrvAng may be missing and t_c be there. openfast_io skips the header: in a valid file
# without BlCrvAng and with t_c, the chord becomes the twist, the number of the airfoil the chord, and the relative
# thickness the airfoil, without an error. Seen: twist 3.5 (chord 3.5 m), chord 1.0, airfoil 0.4.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet openfast_io==4.1.2
cat > blade.dat <<'TABLE'
------- AERODYN BLADE DEFINITION INPUT FILE ----------------------------------
two stations
======  Blade Properties =====================================================
2  NumBlNds - Number of blade nodes used in the analysis (-)
BlSpn BlCrvAC BlSwpAC BlTwist BlChord BlAFID t_c
(m) (m) (m) (deg) (m) (-) (-)
0.0 0.0 0.0 13.3 3.5 1 0.4
60.0 0.0 0.0 0.1 1.4 1 0.2
TABLE
venv/bin/python - <<'PYTHON'
from openfast_io.FAST_reader import InputReader_OpenFAST

reader = InputReader_OpenFAST()
reader.fst_vt["AeroDynBlade"] = [{}]
reader.read_AeroDynBlade("blade.dat", 0)
blade = reader.fst_vt["AeroDynBlade"][0]
seen = {name: blade[name][0] for name in ("BlTwist", "BlChord", "BlAFID")}
print("in the file: twist 13.3 deg, chord 3.5 m, airfoil 1; read:", seen)
raise SystemExit(0 if seen == {"BlTwist": 3.5, "BlChord": 1.0, "BlAFID": 0.4} else 1)
PYTHON
