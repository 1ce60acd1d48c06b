"""Schemes of limited power and their coordination with yaw and pitch, compared on any turbine with blades."""
