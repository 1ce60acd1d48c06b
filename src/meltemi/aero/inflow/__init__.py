"""Inflow models, selected by ``ModelOptions.inflow``: ``advance(m.aero_options.inflow, dt, m, b, n)``.

A model is a module with one kernel of the rotor and three of a node:

* ``time_constant(m)`` [s] of the inflow from the averages of the rotor;
* ``advance(dt, m, b, n)`` advances the induced velocities ``m.inflow`` of the node by ``dt`` [s] towards those of the
  momentum balance; with ``dt`` = 0 they stay;
* ``settle(m, b, n)`` sets them to their steady values;
* ``derivative(m, b, n)`` leaves their time derivatives in ``m.d_inflow``.
"""

from __future__ import annotations

from meltemi.aero.variants import InflowModel
from meltemi.compiler import choice
from meltemi.core.variants import models

MODELS = models(__name__, InflowModel)

time_constant = choice([model.time_constant for model in MODELS])
advance = choice([model.advance for model in MODELS])
settle = choice([model.settle for model in MODELS])
derivative = choice([model.derivative for model in MODELS])
