"""Stall models, selected by ``ModelOptions.stall``: ``advance(m.aero_options.stall, dt, flap, m, b, n)``.

A model is a module with three kernels of a node and a list:

* ``advance(dt, flap, m, b, n)`` advances the states of the node by ``dt`` [s] and returns its coefficients, without the
  increments of the flaps; with ``dt`` = 0 the states stay;
* ``settle(flap, m, b, n)`` sets the states to their steady values;
* ``derivative(flap, m, b, n)`` leaves their time derivatives in ``m.d_stall``;
* ``STATES``: the fields of ``StallState`` that it uses, for linear models.

``flap`` [rad] is the equivalent angle of the flaps (A-48).
"""

from __future__ import annotations

from meltemi.aero.variants import StallModel
from meltemi.compiler import choice
from meltemi.core.variants import models

MODELS = models(__name__, StallModel)
STATIC = 0
"""Number of the model of static polars."""

advance = choice([model.advance for model in MODELS])
settle = choice([model.settle for model in MODELS])
derivative = choice([model.derivative for model in MODELS])
