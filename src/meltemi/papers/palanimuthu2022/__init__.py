"""Palanimuthu et al. (2022): a 20 MW turbine in its climate and on the grid.

``paper`` has the paper's numbers, ``machine`` its turbine and closed forms, ``readings`` its errors with both readings
as numbers, ``winds`` and ``runs`` simulate, ``claims`` compares, ``figures`` redraws, ``beyond`` asks what
the paper left open, ``page`` writes all of it.
"""
