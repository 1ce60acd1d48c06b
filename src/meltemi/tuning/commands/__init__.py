"""``meltemi compare`` and ``meltemi bench-controller``."""
