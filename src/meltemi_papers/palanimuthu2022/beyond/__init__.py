"""Results beyond the paper.

A part is a module of this package with two functions: ``study(runs, *, workers, progress)`` runs it and returns what
it found (``runs.setup.quick``: a look); ``chapter(found, draw)`` puts it into words, figures and tables. Names of files
begin with that of the module.
"""

PARTS = ("power", "coordination", "climate")
"""In the order of the page."""
