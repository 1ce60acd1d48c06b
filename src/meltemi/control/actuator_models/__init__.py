"""Models of the actuators of pitch and flaps: ``advance(number of the model, angle, rate, demand, p, dt)``.

A model is a module with a kernel and a function for linear models:

* ``advance(angle, rate, demand, p, dt)`` returns angle [rad] and rate [rad/s] after ``dt`` [s] under a held demand
  within the limits of the angle, and what its limits add to the count of switches; with ``dt`` = 0 a lag keeps the
  angle;
* ``coefficients(frequency, damping)``: c_0, c_1 of x^(n) = c_0 (demand - x) - c_1 x', the linear equation of the angle
  x of order n = 1 or 2, as a tuple of n entries; empty where the angle is the demand.
"""

from __future__ import annotations

from meltemi.compiler import choice
from meltemi.core.variants import models
from meltemi.turbine.exchange import ActuatorModel

MODELS = models(__name__, ActuatorModel)

advance = choice([model.advance for model in MODELS])
