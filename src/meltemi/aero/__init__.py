"""Rotor and tower aerodynamics: blade-element momentum, dynamic inflow, dynamic stall, tower flow."""
