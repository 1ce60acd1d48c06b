"""Vortex wakes: induced velocities from the vortices behind the blades, in place of the momentum balance.

Reference: docs/theory/vortices.md (VW-1 ...).
"""

FEATURE = "vortex wakes"
