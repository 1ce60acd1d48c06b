"""Load bases: design load cases of IEC 61400-1 as tables, and the plan of all cases of a turbine."""
