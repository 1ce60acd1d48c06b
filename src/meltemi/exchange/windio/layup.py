"""Layup of the blade of a windIO file, of version 2 (``structure``) or 1 (``internal_structure_2d_fem``).

Arcs begin at the trailing edge on the suction side. In version 2 they are those of anchors, in version 1 of the layers
and webs themselves. Both may give one end, or the middle, and a width, or a plane that cuts the surface. Fibre angles
are positive towards the leading edge, in degrees (version 2) or radians (version 1); nu and G are listed as 12, 13, 23.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.yamlfile import parse, read_text, validated
from meltemi.exchange.windio.tree import Tree, as_entries, as_number, as_numbers, load
from meltemi.sections.layup import Layup, arcs

Float = NDArray[np.float64]
Content = dict[str, Any]

BLADE = "components.blade"
ENDS = ("start_nd_arc", "end_nd_arc")
MODULI = {"E": ("E1", "E2", "E3"), "G": ("G12", "G13", "G23"), "nu": ("nu12", "nu13", "nu23")}
STRENGTHS = {"Xt": ("Xt", "Yt"), "Xc": ("Xc", "Yc"), "S": ("S12",), "m": ("fatigue_exponent",)}


def read_layup(path: str | Path) -> Layup:
    """Read the layup of the blade of a windIO file, of version 2 or 1, or of a file that describes a :class:`Layup`.

    Returns:
      Shapes, webs, layers and materials; angles in radians.

    Raises:
      InputError: the file is neither, or describes the layup in a way that is not read; the message names the key.
    """
    text = read_text(path := Path(path))
    if "components:" in text or '"components"' in text:
        return _Reader(load(path, first=True)).layup()
    return validated(parse(text, path, "a Layup"), Layup, str(path), text)


class _Reader:
    def __init__(self, tree: Tree) -> None:
        self.tree = tree
        self.first = tree.get(f"{BLADE}.outer_shape_bem") is not None
        self.shape = f"{BLADE}.outer_shape_bem" if self.first else f"{BLADE}.outer_shape"
        self.structure = f"{BLADE}.internal_structure_2d_fem" if self.first else f"{BLADE}.structure"
        if tree.get(f"{self.structure}.layers") is None:
            raise InputError(f"{tree.where}: {self.structure}.layers is missing: the file has no layup of the blade")
        self.unit = 1.0 if self.first else np.pi / 180.0
        self.anchors: dict[str, Content] = {}
        if not self.first:
            self.anchors = {str(a.get("name")): a for a in tree.entries(f"{self.structure}.anchors")}
        self.base: Layup | None = None

    def layup(self) -> Layup:
        tree = self.tree
        chord = self._read(f"{self.shape}.chord")
        if tree.get(f"{self.shape}.section_offset_y") is not None:
            offset = self._read(f"{self.shape}.section_offset_y")
        else:  # relative to the chord
            share = self._read(f"{self.shape}.pitch_axis")
            grid = np.union1d(chord["grid"], share["grid"])
            offset = {"grid": grid, "values": np.interp(grid, *share.values()) * np.interp(grid, *chord.values())}
        thickness, shapes = self._shapes()
        axis = f"{self.shape}.reference_axis" if self.first else f"{BLADE}.reference_axis"
        content: Content = {
            "name": str(tree.get("name") or Path(tree.where).stem),
            "position": self._read(f"{axis}.z"),
            "chord": chord,
            "offset_y": offset,
            "thickness": thickness,
            "shapes": shapes,
            "source": f"{tree.source} (windIO {1 if self.first else tree.get('windIO_version') or 2})",
        }
        if tree.get(f"{self.shape}.section_offset_x") is not None:
            content["offset_x"] = self._read(f"{self.shape}.section_offset_x")
        layers = tree.entries(f"{self.structure}.layers")
        content["materials"] = self._materials([str(layer.get("material")) for layer in layers])
        bare = {"layers": [{"name": "none", "material": str(layers[0].get("material")), "thickness": 1.0}]}
        self.base = validated(content | bare, Layup, tree.where)  # its contours make arcs of widths
        webs = as_entries(tree.get(f"{self.structure}.webs") or [{}], f"{tree.where}: {self.structure}.webs")
        content["webs"] = [self._web(web) for web in webs if web]
        plies = {str(m.get("name")): m.get("ply_t") for m in tree.entries("materials")}
        content["layers"] = [self._layer(layer, plies) for layer in layers]
        return validated(content, Layup, tree.where)

    def _fail(self, where: str, why: str) -> InputError:
        return InputError(f"{self.tree.where}: {where}: {why}")

    def _read(self, path: str, factor: float = 1.0) -> Content:
        return self._curve(self.tree.need(path), path, factor)

    def _curve(self, value: Any, where: str, factor: float = 1.0) -> Content:
        if not isinstance(value, dict) or "grid" not in value or "values" not in value:
            raise self._fail(where, f"expected grid and values, found {str(value)[:60]!r}")
        grid = as_numbers(value["grid"], f"{self.tree.where}: {where}.grid")
        if isinstance(value["values"], list) and value["values"] and isinstance(value["values"][0], list):
            raise self._fail(
                where, "a thickness that varies round the section is not read; split the layer into several"
            )
        numbers = as_numbers(value["values"], f"{self.tree.where}: {where}.values", len(grid))
        if len(grid) < 2 or np.any(np.diff(grid) <= 0.0):
            raise self._fail(f"{where}.grid", "expected two or more numbers that increase")
        return {"grid": grid, "values": factor * numbers}

    def _shapes(self) -> tuple[Content, list[Content]]:
        """Relative thickness along the blade, and the shapes."""
        tree, key = self.tree, "relative_thickness" if self.first else "rthick"
        library = {str(a.get("name")): a for a in tree.entries("airfoils")}
        if self.first:
            where = f"{self.shape}.airfoil_position"
            places = list(tree.numbers(f"{where}.grid"))
            names = [str(name) for name in tree.need(f"{where}.labels")]
        else:
            where = f"{self.shape}.airfoils"
            names = [str(entry.get("name")) for entry in tree.entries(where)]
            places = [entry.get("spanwise_position") for entry in tree.entries(where)]
        shapes: dict[float, Content] = {}
        thick = []
        for name in names:
            if name not in library:
                raise self._fail(where, f"no airfoil {name!r}: {did_you_mean(name, library)}")
            here = f"{tree.where}: airfoils {name}"
            thick.append(as_number(library[name].get(key), f"{here}: {key}"))
            points = library[name].get("coordinates")
            if not isinstance(points, dict):
                raise self._fail(f"airfoils {name}", "coordinates are missing: x and y, from the trailing edge round")
            x = as_numbers(points.get("x"), f"{here}: coordinates.x")
            y = as_numbers(points.get("y"), f"{here}: coordinates.y", len(x))
            if np.sum(x[:-1] * np.diff(y) - y[:-1] * np.diff(x)) < 0.0:  # pressure side first
                x, y = x[::-1], y[::-1]
            shapes[thick[-1]] = {"thickness": thick[-1], "coordinates": np.stack([x, y], axis=1)}
        if tree.get(f"{self.shape}.rthick") is not None:
            curve = self._read(f"{self.shape}.rthick")
        else:
            from scipy.interpolate import PchipInterpolator

            if any(place is None for place in places) or len(set(places)) < 2:
                raise self._fail(where, "rthick is missing, so every airfoil needs a spanwise position")
            along = {float(p): t for p, t in zip(places, thick, strict=True)}
            grid = np.linspace(min(along), max(along), 101)
            curve = {"grid": grid, "values": PchipInterpolator(sorted(along), [along[p] for p in sorted(along)])(grid)}
        return curve, list(shapes.values())

    def _materials(self, names: list[str]) -> dict[str, Content]:
        known = {str(m.get("name")): m for m in self.tree.entries("materials")}
        found = {}
        for name in dict.fromkeys(names):
            if name not in known:
                raise self._fail("materials", f"no material {name!r}: {did_you_mean(name, known)}")
            found[name] = self._material(known[name], f"{self.tree.where}: materials {name}")
        return found

    def _material(self, m: Content, where: str) -> Content:
        content: Content = {"density": as_number(m.get("rho"), f"{where}: rho")}
        if m.get("orth"):
            values = {key: as_numbers(m.get(key), f"{where}: {key}", 3).tolist() for key in MODULI}
        else:
            E, nu = (as_number(m.get(key), f"{where}: {key}") for key in ("E", "nu"))
            values = {"E": [E] * 3, "G": [E / (2.0 * (1.0 + nu))] * 3, "nu": [nu] * 3}
        for key, names in MODULI.items():
            content |= dict(zip(names, values[key], strict=True))
        for key, ours in STRENGTHS.items():
            value = m.get(key)
            numbers = value if isinstance(value, list) else [value] * 3
            for one, number in zip(ours, numbers, strict=False):
                if isinstance(number, (int, float)) and number > (key == "m"):  # files write 0 for what is not known
                    content[one] = float(number)
        return content

    def _web(self, web: Content) -> Content:
        start, end = (self._arc(web, handle, f"{self.structure}.webs {web.get('name')}") for handle in ENDS)
        return {"name": str(web.get("name")), "start": start, "end": end}

    def _layer(self, layer: Content, plies: dict[str, Any]) -> Content:
        name, material = str(layer.get("name")), str(layer.get("material"))
        where = f"{self.structure}.layers {name}"
        content: Content = {"name": name, "material": material}
        if layer.get("thickness") is not None:
            content["thickness"] = self._curve(layer["thickness"], f"{where}.thickness")
        elif layer.get("n_plies") is not None:
            of = f"{self.tree.where}: materials {material}: ply_t (for n_plies of {where})"
            one = as_number(plies.get(material), of)
            content["thickness"] = self._curve(layer["n_plies"], f"{where}.n_plies", one)
        else:
            raise self._fail(where, "thickness is missing")
        if layer.get("fiber_orientation") is not None:
            content["angle"] = self._curve(layer["fiber_orientation"], f"{where}.fiber_orientation", self.unit)
        known = None
        if (web := layer.get("web")) is not None:
            content["web"] = str(web)
            if self.first:
                return content
            webs = {str(w.get("name")): w for w in self.tree.entries(f"{self.structure}.webs")}
            if web not in webs:
                raise self._fail(where, f"no web {web!r}: {did_you_mean(str(web), webs)}")
            known = {str(a.get("name")): a for a in webs[web].get("anchors") or []}
        for handle, ours in zip(ENDS, ("start", "end"), strict=True):
            content[ours] = self._arc(layer, handle, where, known)
        return content

    def _arc(
        self, entry: Content, handle: str, where: str, anchors: dict[str, Content] | None = None, depth: int = 0
    ) -> Content:
        """Curve of an arc: given, that of an anchor, or from another one and a width."""
        value = entry.get(handle)
        if depth > 20:
            raise self._fail(where, "its anchors refer to each other in a circle")
        if isinstance(value, dict) and "values" in value:
            return self._curve(value, f"{where}.{handle}")
        if isinstance(value, dict) and isinstance(value.get("anchor"), dict):
            known = self.anchors if anchors is None else anchors
            name, other = str(value["anchor"].get("name")), str(value["anchor"].get("handle"))
            if name not in known:
                raise self._fail(f"{where}.{handle}", f"no anchor {name!r}: {did_you_mean(name, known)}")
            place = f"{self.structure}.anchors {name}"
            return self._arc(known[name], other, place, anchors, depth + 1)
        for key in ("offset_nd_arc", "offset_arc"):
            offset = entry.get(key)
            if isinstance(offset, dict) and offset.get("defines") == handle:
                base = self._arc(
                    {handle: {"anchor": offset.get("anchor")}}, handle, f"{where}.{key}", anchors, depth + 1
                )
                values = offset["values"] if isinstance(offset.get("values"), dict) else offset
                return self._moved(base, self._curve(values, f"{where}.{key}"), 1.0, key == "offset_arc")
        by_width = handle in ENDS and entry.get("width") is not None
        if by_width and (found := self._from_width(entry, handle, where, anchors, depth)):
            return found
        if (plane := self._plane(entry, where)) is not None:
            return self._cut(*plane, handle)
        raise self._fail(
            f"{where}.{handle}", "missing: expected grid and values, an anchor, a plane, or a width and another arc"
        )

    def _plane(self, entry: Content, where: str) -> tuple[Content, Content, str] | None:
        """Angle [rad] of the plane's normal from the chord, towards the suction side; its offset [m]; its side."""
        tree, plane = self.tree, entry.get("plane_intersection")
        if entry.get("offset_y_pa") is not None:
            turn = self._curve(entry.get("rotation"), f"{where}.rotation")
            return turn, self._curve(entry["offset_y_pa"], f"{where}.offset_y_pa"), str(entry.get("side") or "both")
        if not isinstance(plane, dict):
            return None
        where += ".plane_intersection"
        first = plane.get("plane_type1")
        if not isinstance(first, dict) or first.get("anchor_curve") != "reference_axis":
            raise self._fail(
                where, "only plane_type1 with the anchor_curve reference_axis is read; write the arcs into the file"
            )
        ends = as_numbers(first.get("anchors_nd_grid"), f"{tree.where}: {where}.plane_type1.anchors_nd_grid", 2)
        turned = np.radians(as_number(first.get("rotation", 0.0), f"{tree.where}: {where}.plane_type1.rotation"))
        offset = self._curve(plane.get("offset"), f"{where}.offset")
        z, y = (self._read(f"{BLADE}.reference_axis.{c}") for c in "zy")
        twist = self._read(f"{self.shape}.twist", -self.unit)
        along = np.interp(ends, *z.values()), np.interp(ends, *y.values())
        line = np.interp(np.interp(offset["grid"], *z.values()), *along) - np.interp(offset["grid"], *y.values())
        offset = {"grid": offset["grid"], "values": offset["values"] + line * np.cos(turned)}
        turn = {"grid": twist["grid"], "values": twist["values"] + turned}
        return turn, offset, str(plane.get("side"))

    def _cut(self, turn: Content, offset: Content, side: str, handle: str) -> Content:
        """Arcs at which a plane cuts a side of the contour; both sides have the start on the suction side."""
        assert self.base is not None
        suction = side == "suction" or (side == "both" and handle == ENDS[0])
        grid = np.union1d(offset["grid"], self.base.chord.grid)
        grid = grid[(grid >= offset["grid"][0]) & (grid <= offset["grid"][-1])]
        values = []
        for station in grid:
            contour = self.base.contour(float(station))
            angle = np.interp(station, *turn.values())
            across = contour @ [np.sin(angle), np.cos(angle)] - np.interp(station, *offset.values())
            le, s = int(np.argmin(contour[:, 1])), arcs(contour)
            part = slice(0, le + 1) if suction else slice(le, None)
            order = np.argsort(across[part])
            values.append(np.interp(0.0, across[part][order], s[part][order]))
        return {"grid": grid, "values": np.array(values)}

    def _from_width(self, entry: Content, handle: str, where: str, anchors: Any, depth: int) -> Content | None:
        width = self._curve(entry["width"], f"{where}.width")
        sign = -1.0 if handle == ENDS[0] else 1.0
        plane = entry.get("plane_intersection") or {}
        middle = entry.get("offset_y_pa") is not None or "midpoint_nd_arc" in (plane.get("defines") or ())
        for other, share in (("midpoint_nd_arc", 0.5), (ENDS[0] if sign > 0.0 else ENDS[1], 1.0)):
            if entry.get(other) is not None or (middle and share < 1.0):
                return self._moved(self._arc(entry, other, where, anchors, depth + 1), width, sign * share, True)
        return None

    def _moved(self, base: Content, by: Content, factor: float, metres: bool) -> Content:
        """An arc moved by an offset, in metres or as a fraction of the contour."""
        grid = np.union1d(base["grid"], by["grid"])
        step = factor * np.interp(grid, *by.values())
        if metres:
            assert self.base is not None
            grid = np.union1d(grid, self.base.chord.grid)  # the contour's length changes between
            step = factor * np.interp(grid, *by.values())
            contours = [self.base.contour(float(x)) for x in grid]
            step /= [float(np.sum(np.hypot(*np.diff(c, axis=0).T))) for c in contours]
        return {"grid": grid, "values": np.clip(np.interp(grid, *base.values()) + step, 0.0, 1.0)}
