#!/usr/bin/env bash
# neuralfoil 0.3.3: the coefficients of a shape depend on where it lies, how long it is and where its points begin.
#
# Guess: coefficients are those of the shape: get_aero_from_coordinates normalises it, or refuses one that is not normalised.
# Seen, NACA 4412 at 4 degrees: points from the trailing edge over the lower side instead of the upper one move transition on
# the upper side from 0.39 to 0.28 of the chord; a chord of 2 changes the moment from -0.10 to -0.32, a shift by 0.3 chords
# to -0.38. With coordinates about the pitch axis, as files of blades have them, moments are those of another place; the
# confidence stays above 0.9.
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
ways = {"upper side first": shape, "lower side first": shape[::-1], "chord 2": 2 * shape, "moved": shape + [0.3, 0.2]}
for name, points in ways.items():
    aero = nf.get_aero_from_coordinates(points, alpha=4.0, Re=3e6)
    keys = ("CL", "CM", "Top_Xtr", "analysis_confidence")
    found[name] = lift, moment, transition, sure = [float(np.ravel(aero[key])[0]) for key in keys]
    print(f"{name:17s} lift {lift:.3f}, moment {moment:+.3f}, transition {transition:.2f}, confidence {sure:.2f}")
(_, one, upper, _), (_, _, lower, _), (_, two, _, _), (_, moved, _, _) = found.values()
seen = abs(upper - lower) > 0.05 and two < 2.5 * one and moved < 3.0 * one
raise SystemExit(0 if seen and all(each[-1] > 0.9 for each in found.values()) else 1)
PYTHON
