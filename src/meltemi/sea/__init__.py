"""Sea: descriptions of waves and current, and their kinematics at points over time."""

from meltemi.namespaces import public

KERNELS = ()
__getattr__, __dir__ = public(__name__)
