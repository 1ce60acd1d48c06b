"""The engine of turbines of a power coefficient: model, case, step and steady operation."""

FEATURE = "power-coefficient turbines"
