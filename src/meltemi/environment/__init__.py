"""Environment of the turbine: air, rain, climate, grid."""

from meltemi.namespaces import public

__getattr__, __dir__ = public(__name__)
