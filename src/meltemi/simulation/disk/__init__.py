"""Rotors with a power coefficient: a disk in the wind, and a shaft."""

FEATURE = "power-coefficient turbines"
