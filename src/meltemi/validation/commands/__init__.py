"""``meltemi validate``."""
