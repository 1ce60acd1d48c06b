"""Analyses of a model: modes, linear models, Campbell diagrams, parked turbines, performance and power curves."""

KERNELS = ()
