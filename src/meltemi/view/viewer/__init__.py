"""Scripts, style and page of the three-dimensional view, with three.js (MIT licence)."""

from functools import cache
from pathlib import Path

from meltemi.core.files import text_of

FOLDER = Path(__file__).parent
SCRIPTS = ("three.min", "data", "pose", "sea", "wakes", "turbine", "vortices", "wind", "plots", "viewer")
"""Scripts of the view, in this order; ``file`` or ``widget`` follows, with ``live`` before it for a live scene."""


@cache
def beside(name: str) -> str:
    """Text of a file of the viewer."""
    return text_of(FOLDER / name)


def script(*ends: str) -> str:
    """The scripts of the view, with three.js, for a page (``file``) or for a notebook (``widget``)."""
    return "\n".join(beside(f"{name}.js") for name in (*SCRIPTS, *ends))
