"""He et al. (2018): combined individual pitch and trailing-edge flap control (CPFC) of the NREL 5 MW in turbulence.

``runs`` simulates, ``claims`` compares with the paper, ``checks`` looks at its equations one by one, ``beyond`` asks
what the paper left open, ``figures`` redraws its figures, ``page`` writes all of it.
"""
