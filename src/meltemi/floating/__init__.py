"""Floating turbines: platforms in potential flow, moorings.

The public name is in ``meltemi.turbine`` (platform).
"""

FEATURE = "the floating platform"
KERNELS = ("base.py", "moving_base.py", "floater.py", "catenary.py", "lumped.py", "mooring.py", "segments.py")
