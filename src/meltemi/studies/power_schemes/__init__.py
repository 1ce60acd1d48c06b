"""Comparison of schemes of limited power, and of their coordination with yaw and pitch, for any turbine with blades."""
