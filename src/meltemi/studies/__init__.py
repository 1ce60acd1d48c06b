"""Studies of a turbine: stability, observer, differences of results, scaling, icing, preview and lidar."""

KERNELS = ("constrained_pitch.py", "lidar.py")
