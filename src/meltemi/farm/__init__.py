"""Farms: turbines in each other's wakes, one wind, a table and a view of what the wakes cost."""

KERNELS = ("field.py", "march.py", "curled.py", "averages.py", "rotor.py")

FEATURE = "the wakes of a farm"
