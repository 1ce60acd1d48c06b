"""Events of a simulation: faults, grid losses and operator requests."""

from meltemi.namespaces import public

__getattr__, __dir__ = public(__name__)
