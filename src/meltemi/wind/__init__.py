"""Wind: descriptions, files, turbulence, and the velocity at a point and time."""

from meltemi.namespaces import public

__getattr__, __dir__ = public(__name__)
