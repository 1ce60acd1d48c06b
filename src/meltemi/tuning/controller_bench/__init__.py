"""Test bench of controllers: a fixed suite of cases, the same for all, with margins, limits and a report."""
