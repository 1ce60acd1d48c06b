"""All kinds of seas, as case files name them."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from meltemi.sea.conditions import StillWater
from meltemi.sea.given import ComponentSea, ElevationSea
from meltemi.sea.irregular import IrregularSea
from meltemi.sea.regular import RegularSea

AnySea = Annotated[IrregularSea | RegularSea | ComponentSea | ElevationSea | StillWater, Field(discriminator="kind")]
