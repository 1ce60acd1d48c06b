"""Published studies, reproduced with their set-up and compared claim by claim: ``meltemi reproduce``.

Methods for any turbine are in ``meltemi.studies`` and have separate commands; nothing imports this package.
"""

KERNELS = ()
