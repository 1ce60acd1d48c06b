"""``meltemi view`` and ``meltemi live``."""
