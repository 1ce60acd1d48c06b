"""``meltemi inspect``."""
