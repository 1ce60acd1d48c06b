"""Studies of a turbine: stability, observer, differences of results, scaling, icing, preview and lidar."""

KERNELS = ("lidar.py",)
