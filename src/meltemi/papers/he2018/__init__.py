"""He et al. (2018): combined individual pitch and trailing-edge flap control (CPFC) of the NREL 5 MW in turbulence.

``runs`` simulates, ``claims`` compares with the paper, ``beyond`` has results beyond the paper, ``figures`` redraws its
figures, ``page`` writes the page.
"""
