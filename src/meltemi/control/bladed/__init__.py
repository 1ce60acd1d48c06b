"""Bladed-style controller libraries as controllers of a run."""
