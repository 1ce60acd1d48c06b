"""Palanimuthu et al. (2022): a 20 MW turbine in its climate and on the grid.

``paper`` has the paper's numbers, ``machine`` its turbine and closed forms, ``readings`` its errors with both readings
as numbers, ``winds`` and ``runs`` simulate, ``claims`` compares, ``figures`` redraws the figures, ``beyond`` has
results beyond the paper, ``page`` writes the page.
"""
