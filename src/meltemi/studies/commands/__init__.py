"""``meltemi diff``, ``meltemi observe``, ``meltemi flutter``, ``meltemi parked``."""
