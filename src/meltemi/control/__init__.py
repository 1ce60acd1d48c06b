"""Controllers and actuators."""

import meltemi.compiler.record_types  # noqa: F401 - by it kernels know what a table of a vector is
from meltemi.namespaces import public

__getattr__, __dir__ = public(__name__)
