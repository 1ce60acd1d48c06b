"""Coupled aeroelastic simulation: model, time integration, steady operation, results."""
