"""Floating turbines: platforms in potential flow, moorings.

The public name is in ``meltemi.turbine`` (platform).
"""

KERNELS = ("floater.py", "catenary.py", "lumped.py", "mooring.py")
