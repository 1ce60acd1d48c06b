"""Wang et al. (2021): yaw-error thresholds and derating instead of shutdown, on a whole turbine.

``winds`` makes the winds, ``runs`` simulates, ``claims`` compares with the paper, ``figures`` redraws its figures,
``beyond`` asks what the paper left open, ``page`` writes all of it.
"""
