"""Vortex wakes: induced velocities from the vortices behind the blades, in place of the momentum balance.

Reference: docs/theory/vortices.md (VW-1 ...).
"""

KERNELS = ("filaments.py", "line.py", "near_wake.py", "part.py", "start.py", "tables.py", "wake.py")
FEATURE = "vortex wakes"
