"""Published studies, reproduced from their own set-up and compared claim by claim: ``meltemi reproduce``.

What works on any turbine stands in ``meltemi.studies`` and has commands of its own; nothing imports this package.
"""

KERNELS = ()
