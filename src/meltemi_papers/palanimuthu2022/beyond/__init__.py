"""What lies beyond the paper.

A part is a module of this package with four functions: ``study(runs, *, workers, progress)`` runs it and returns what
it found (``runs.setup.quick``: a look; ``progress`` is called with the share that is done and what is under way);
``tables(found)`` gives by file name heading and tables, ``figures(found)`` by file name caption and figure, and
``verdict(found)`` the answer in words. Names of files begin with that of the module.
"""

PARTS = ("power", "coordination", "climate")
"""In the order of the page."""
