"""meltemi."""
