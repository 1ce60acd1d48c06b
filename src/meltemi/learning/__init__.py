"""Learning environments for Gymnasium; :mod:`meltemi.envs` is their public interface."""

from importlib.util import find_spec

KERNELS = ("kernels.py",)

if find_spec("gymnasium"):
    from meltemi.learning.gym import register

    register()
    del register
