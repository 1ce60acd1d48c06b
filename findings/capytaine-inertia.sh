#!/usr/bin/env bash
# capytaine 3.0.0 gives a spar with its mass and centre of mass an inertia matrix that no body can have.
#
# Guess: compute_rigid_body_inertia has the mass that the body was given on its diagonal, and moments of inertia that fit
# the centre of mass. Seen, for a spar from 120 m below to 10 m above the sea, with 7.466e6 kg and its centre of mass at
# -89.9 m: the mass is multiplied by the share of the hull under water, 6.89e6 kg; the moments of inertia are those of
# a homogeneous hull, wherever the centre of mass is, while the coupling of surge and pitch is m z. With the ballast of
# a spar, I_yy < m z^2: an eigenvalue is negative, and the mass matrix is not positive definite.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
python3 -m venv venv
venv/bin/pip install --quiet capytaine==3.0.0
venv/bin/python - <<'PYTHON'
import capytaine as cpt
import numpy as np

hull = cpt.mesh_vertical_cylinder(length=130.0, radius=4.7, center=(0.0, 0.0, -55.0), resolution=(4, 24, 65))
moments = {}
for z in (-60.0, -89.9):
    dofs = cpt.rigid_body_dofs(rotation_center=(0.0, 0.0, 0.0))
    body = cpt.FloatingBody(hull, dofs=dofs, center_of_mass=(0.0, 0.0, z), mass=7.466e6)
    M = body.compute_rigid_body_inertia(rho=1025.0).values
    moments[z] = M[4, 4]
    print(f"centre of mass {z} m: M11 {M[0, 0]:.4g} kg, I_yy / M11 {M[4, 4] / M[0, 0]:.0f} m2, z^2 {z * z:.0f} m2")
lowest = np.linalg.eigvalsh(M[np.ix_([0, 4], [0, 4])])[0]
print(f"lowest eigenvalue of surge and pitch: {lowest:.3g}")
wet = 120.0 / 130.0
raise SystemExit(0 if abs(M[0, 0] / 7.466e6 - wet) < 2e-3 and moments[-60.0] == moments[-89.9] and lowest < 0 else 1)
PYTHON
