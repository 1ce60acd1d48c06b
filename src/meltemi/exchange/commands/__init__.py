"""``meltemi import`` and ``meltemi export``."""
