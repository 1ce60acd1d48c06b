"""Analyses built on the package: comparison and tuning of controllers, sensitivities, icing, export of decks."""

KERNELS = ("lidar.py",)
