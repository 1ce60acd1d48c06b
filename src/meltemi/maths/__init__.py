"""Numerical methods independent of turbines: vectors, rotations, tables, small linear systems."""
