"""Wind farms: turbines in each other's wakes, with tables, figures and views of the wake losses."""

KERNELS = ("field.py", "march.py", "curled.py", "averages.py", "release.py", "rotor.py", "sets.py")

FEATURE = "the wakes of a farm"
