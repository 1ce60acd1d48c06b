"""The logger ``meltemi`` of the standard library: silent until an application asks for it with ``logging``."""

import logging

LOG = logging.getLogger("meltemi")
LOG.addHandler(logging.NullHandler())
