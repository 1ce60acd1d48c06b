"""Structural dynamics: beams, their modes, and the flexible multibody turbine."""
