"""Structural dynamics: beams, their modes, and the flexible multibody system of the turbine."""
