"""``meltemi loads`` and ``meltemi surrogate``."""
