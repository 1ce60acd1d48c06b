"""Timed parts of the package that no command measures, and the page of performance."""
