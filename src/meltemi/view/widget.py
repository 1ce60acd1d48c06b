"""The three-dimensional view as a widget of notebooks; needs anywidget, the extra ``notebook``."""

from __future__ import annotations

from typing import Any

import anywidget
import traitlets

from meltemi.view.viewer import beside, script


class ViewWidget(anywidget.AnyWidget):  # type: ignore[misc]
    """A view in a notebook.

    Attributes:
      time: [s] time of the run, wind or vibration that is shown; setting it moves the view. While the view plays, it is
        updated five times per second.
      playing: whether the view plays.
    """

    _esm = script("widget")
    spec = traitlets.Dict().tag(sync=True)
    scenes = traitlets.List().tag(sync=True)
    content = traitlets.Unicode(beside("page.html")).tag(sync=True)
    style = traitlets.Unicode(beside("view.css")).tag(sync=True)
    licence = traitlets.Unicode(beside("three-licence.txt")).tag(sync=True)
    time = traitlets.Float(0.0).tag(sync=True)
    playing = traitlets.Bool(True).tag(sync=True)

    def bundle(self) -> dict[str, Any]:
        """Representations of the view by MIME type."""
        bundle = self._repr_mimebundle_()
        return dict(bundle[0] if isinstance(bundle, tuple) else bundle)
