"""Offshore turbines: waves and current, their loads on a pile, the pile below the tower, soil; ``meltemi sea``.

Public names are in ``meltemi.environment`` (seas) and ``meltemi.turbine`` (support and soil).
"""

KERNELS = ("blade_dampers.py", "mass_dampers.py", "pile.py")
