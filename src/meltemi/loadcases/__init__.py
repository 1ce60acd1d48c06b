"""Load cases as data."""
