"""The paper's figures, redrawn from our formulas and runs."""
