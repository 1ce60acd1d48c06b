"""Learning environments for Gymnasium: turbines in turbulent wind that an agent controls."""

from importlib.util import find_spec

from meltemi.namespaces import public

__getattr__, __dir__ = public(__name__)

if find_spec("gymnasium"):
    __getattr__("IDS")  # importing them registers them
