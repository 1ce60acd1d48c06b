"""A year of wind, second by second: how often the yaw error passes its threshold, and what each strategy makes of it.

The supervisor's own yaw control and yaw protection run at 1 Hz on a wind of their own; the turbine is its steady power
curve. Direction changes come from four sources:

* turbulence: lateral velocities of 0.8 of the longitudinal ones (IEC 61400-1), which have the intensity of the site at
  that wind speed (Table 2);
* meandering: lateral velocities of 0.6 m/s over tens of minutes whatever the wind speed, so that light winds turn most
  (after Mahrt 2011, J. Appl. Meteorol. Climatol. 50, 144-152);
* weather: the direction drifts within hours;
* fronts and gust fronts: a number a year of fast turns with a rise of the wind, of which no statistics are at hand; the
  number is varied.

The mean wind has a Weibull distribution and changes within hours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from meltemi.control import signals as s
from meltemi.control.supervisor.protection import Protection, protection_state, protection_step
from meltemi.control.yaw import YawControl, yaw_settings, yaw_start, yaw_step
from meltemi.core.kernel import kernel
from meltemi.studies.reproduce.wang2021.winds import measured

Float = NDArray[np.float64]
