"""Learning environments for Gymnasium, which :mod:`meltemi.envs` shows."""

from importlib.util import find_spec

KERNELS = ("kernels.py",)

if find_spec("gymnasium"):
    from meltemi.learning.gym import register

    register()
    del register
