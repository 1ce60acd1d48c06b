"""Rotors with a power coefficient: a disk in the wind, and a shaft."""
