"""Published studies, reproduced from their own set-up and compared claim by claim: ``meltemi reproduce``.

Nothing in meltemi imports this package; ``scaled_turbine`` (:mod:`meltemi_papers.wang2021.turbines`) made two turbines
of its library.
"""
