"""Rotors with flexible blades on a flexible tower."""
