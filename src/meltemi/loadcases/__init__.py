"""What is done to a turbine: load cases as data."""
