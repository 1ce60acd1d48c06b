"""Learning environments for Gymnasium: turbines in turbulent wind that an agent controls."""

from importlib.util import find_spec

from meltemi.namespaces import public

__getattr__, __dir__ = public(__name__)

KERNELS = ("kernels.py",)

if find_spec("gymnasium"):
    from meltemi.envs.gym import register

    register()
    del register
