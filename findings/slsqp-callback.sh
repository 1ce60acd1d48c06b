#!/usr/bin/env bash
# SciPy 1.17.1: the callback of minimize(method="SLSQP") gets trials that the line search refuses, not the iterates.
#
# Guess: as with BFGS, the callback gets the point that an iteration ends with, so that its function values fall. Seen: it
# is called with the first trial of each line search. On Rosenbrock's function from (-1.2, 1) the first "iterate" is 2e11,
# where the accepted one is 12.2. The accepted points are those where the gradient is evaluated.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet numpy scipy==1.17.1
cat > search.py <<'PYTHON'
from scipy.optimize import minimize, rosen, rosen_der

called, sloped = [], []


def slope(x):
    sloped.append(float(rosen(x)))
    return rosen_der(x)


found = minimize(rosen, [-1.2, 1.0], jac=slope, method="SLSQP", callback=lambda x: called.append(float(rosen(x))))
rises = [sum(b > a for a, b in zip(values, values[1:])) for values in (called, sloped)]
print(f"iterations {found.nit}; first value of the callback {called[0]:.3g}, of the gradients after the start "
      f"{sloped[1]:.3g}; values that rise: {rises[0]} of the callback, {rises[1]} of the gradients")
assert len(called) == found.nit and called[0] > 1e11 and sloped[1] < 24.2 and rises[0] > 0 and rises[1] == 0
PYTHON
venv/bin/python search.py
