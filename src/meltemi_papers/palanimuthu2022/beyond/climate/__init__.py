"""Effect of weather on annual energy and lifetime loads: an aeroelastic turbine in turbulence, at three sites.

``response`` simulates what the turbine does over wind speed, density and ice; ``year`` puts it together with the months
of a climate; ``report`` and ``review`` say it in tables, a figure and words.
"""

from __future__ import annotations

from meltemi_papers.palanimuthu2022.beyond.climate.report import chapter as chapter
from meltemi_papers.palanimuthu2022.beyond.climate.year import study as study
