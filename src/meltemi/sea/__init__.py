"""Sea: descriptions of waves and current, and their kinematics at points over time.

Public names are in ``meltemi.environment``.
"""

KERNELS = ()
