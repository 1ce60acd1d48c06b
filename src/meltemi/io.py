"""Files of other programs and of meltemi: results, winds, turbines, cases, tables."""

from meltemi.namespaces import public

__getattr__, __dir__ = public(__name__)
