"""All kinds of seas, as case files name them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

from pydantic import Field

from meltemi.core.record import Record
from meltemi.core.yamlfile import validated
from meltemi.sea.conditions import Sea, StillWater
from meltemi.sea.given import ComponentSea, ElevationSea
from meltemi.sea.irregular import IrregularSea
from meltemi.sea.regular import RegularSea

AnySea = Annotated[IrregularSea | RegularSea | ComponentSea | ElevationSea | StillWater, Field(discriminator="kind")]


class _Described(Record):
    sea: AnySea


def sea_of(content: Mapping[str, Any], where: str) -> Sea:
    """The sea with keys as in a case file.

    Raises:
      InputError: the keys do not describe a sea.
    """
    return validated({"sea": dict(content)}, _Described, where).sea
