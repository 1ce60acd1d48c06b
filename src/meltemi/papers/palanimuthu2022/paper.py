"""Numbers that the paper states. Missing or wrong numbers are treated in ``readings``."""

from __future__ import annotations

from meltemi.papers.claim import claims_of, sentences_of

claim, sentence = claims_of("palanimuthu2022"), sentences_of("palanimuthu2022")
RADIUS = 138.0
"""[m] Table 1."""
TIP_SPEED_RATIO, POWER_COEFFICIENT = 9.5085, 0.48
"""Table 1: at the best point."""
WIND, SPEED, POWER = 10.715, 0.75, 21.2e6
"""[m/s], [rad/s], [W] rated; the speed is that of Figures 4 and 5."""
STATOR_POWER = 20e6
"""[W] Table 1."""
POLE_PAIRS, FLUX, INDUCTANCE, RESISTANCE, VOLTAGE = 80, 93.0, 27.49e-3, 44.25e-3, 6800.0
"""[-], [Wb], [H], [Ohm], [V] between lines: the machine of Table 1; 160 "stator poles" are 80 pairs."""
GRID_VOLTAGE, FILTER_INDUCTANCE = 6600.0, 2.1e-3
"""[V], [H] Table 1."""
GAINS = {40.0: 58.2e3, -10.0: 71.3e3}
"""[W] gain of the adapted law in Figure 6 by temperature [degC]."""
DENSITIES = {(-10.0, 0.0): 1.3408, (-10.0, 2000.0): 1.0340, (35.0, 0.0): 1.1359, (35.0, 2000.0): 0.9081}
"""[kg/m^3] air density by temperature [degC] and altitude [m]: the numbers of Figure 3, paired by the formulas."""
REFERENCE = 15e6
"""[W] power reference of Figure 21."""
DROP, RATE = 3.0, 32.0
"""Drop diameter [mm] of Figure 14's caption; rain rate [mm/h] of Figures 10 to 13 (not stated: class "rainstorm")."""
TEMPERATURES = (40.0, 30.0, 20.0, 10.0, 0.0, -10.0)
"""[degC] temperatures of Figure 6."""
HUMIDITIES = (0.0, 0.2, 0.4, 0.6, 0.8, 1.0)
"""Relative humidities of Figure 7."""
ALTITUDES = (0.0, 500.0, 1000.0, 1500.0, 2000.0)
"""[m] altitudes of Figures 3 and 5."""
