"""Wang et al. (2021): yaw-error thresholds and derating instead of shutdown, on an aeroelastic turbine.

``winds`` has the winds, ``runs`` simulates, ``claims`` compares with the paper, ``figures`` redraws its figures,
``beyond`` has results beyond the paper, ``page`` writes the page.
"""
