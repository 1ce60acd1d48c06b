"""The turbine as an engineer describes it: validated, immutable, SI, at the stations of its source."""
