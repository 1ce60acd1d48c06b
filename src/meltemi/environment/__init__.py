"""Environment of the turbine: air, rain, climate, grid."""
