"""Numerics that know nothing about turbines: vectors, rotations, tables, small linear solves."""
