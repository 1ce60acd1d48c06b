"""Wind files: one module per format; the table of the formats is ``meltemi.wind_files.formats``."""

from meltemi.namespaces import public

KERNELS = ()

__getattr__, __dir__ = public(__name__, explain=False)
