"""``meltemi section``: stiffness and mass of a blade's sections from its layup."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np

from meltemi.app.scans import values_of
from meltemi.app.signatures import Range
from meltemi.app.terminal import OutOption, print_table, progress_bar, say, suggest, warn, write_figure, wrote
from meltemi.core.errors import InputError

if TYPE_CHECKING:
    from meltemi.sections.layup import Layup
    from meltemi.sections.properties import SectionModel

NAMES = {"walls": "thin walls", "elements": "finite elements"}


def section(
    file: Annotated[Path, "Layup of a blade: a windIO file, a layup file, or a turbine of the library that has one."],
    at: Annotated[str, "Stations as fractions of the span, e.g. 0.3,0.5 or 0.1:0.9:0.2."] = "0.25,0.5,0.75",
    model: Annotated[
        Literal["both", "walls", "elements"], "Thin walls, finite elements, or both and their difference."
    ] = "both",
    pieces: Annotated[int, "Finite elements round the contour.", Range(24, 2000)] = 120,
    out: OutOption = Path("out"),
) -> None:
    """Compute 6 x 6 stiffness and mass, centres and masses of a blade's sections from its layup."""
    from meltemi.report.tables import number, write_csv
    from meltemi.sections.elements import finite_element_section
    from meltemi.sections.files import find_layup
    from meltemi.sections.plots import plot_section
    from meltemi.sections.thin_walled import thin_walled_section

    layup = find_layup(file)
    stations = values_of(at, "--at")
    if wrong := [station for station in stations if not 0.0 <= station <= 1.0]:
        raise InputError(f"--at {wrong[0]:g}: expected fractions of the span from 0 to 1")
    kinds = list(NAMES) if model == "both" else [model]
    matrices, centres, masses, files, problems = [], [], [], [], []
    with progress_bar("sections", len(stations), "stations") as progress:
        for count, station in enumerate(stations):
            one, found = layup.section(station), {}
            for kind in kinds:
                try:
                    found[kind] = thin_walled_section(one) if kind == "walls" else finite_element_section(one, pieces)
                except InputError as error:
                    if kinds == [kind]:
                        raise
                    problems.append(str(error))
            z = number(layup.position.at(station))
            for kind, made in found.items():
                where = [number(station), z, NAMES[kind]]
                for name, M in (("stiffness", made.stiffness), ("mass", made.mass)):
                    matrices += [[*where, name, str(i + 1), *map(number, row)] for i, row in enumerate(M)]
                centres.append([*where, *(number(value) for _, _, value in _quantities(made))])
                masses += [
                    [*where, p.name, p.material, number(m)] for p, m in zip(one.plies, made.ply_mass, strict=True)
                ]
            _print(station, layup, found)
            files.append(write_figure(out / f"{file.stem}-{station:g}.png", plot_section(list(found.values())[-1])))
            progress((count + 1) / len(stations))
    for problem in dict.fromkeys(problems):
        warn([problem])
    head = ["station", "position [m]", "model"]
    names = [name if unit == "-" else f"{name} [{unit}]" for name, unit, _ in _quantities(next(iter(found.values())))]
    files.append(write_csv(out / f"{file.stem}-sections.csv", [*head, *names], centres))
    files.append(write_csv(out / f"{file.stem}-matrices.csv", [*head, "matrix", "row", *"123456"], matrices))
    files.append(write_csv(out / f"{file.stem}-masses.csv", [*head, "layer", "material", "mass [kg/m]"], masses))
    say(
        "Axes of the section: x towards the suction side, y towards the trailing edge, z towards the tip, from the "
        "reference axis; rows and columns of the matrices: force x, y, z, moment about x, y, z.\n"
        f"Finite elements: {pieces} round the contour and one through each ply; fibres and normals follow the wall."
    )
    wrote(*files)
    suggest("section", file, "--at", f"{stations[0]:g}", "--model", "elements", "--pieces", 2 * pieces)


def _quantities(made: SectionModel) -> list[tuple[str, str, float]]:
    """Name, unit and value of what describes a section."""
    from meltemi.sections.properties import centres_of

    c, K = centres_of(made.stiffness, made.mass), np.diag(made.stiffness)
    F = np.linalg.inv(made.stiffness)
    values = [("mass", "kg/m", made.mass[0, 0]), ("axial stiffness", "N", K[2])]
    values += [
        (f"bending stiffness, {name}", "N m^2", EI) for name, EI in zip(("weak", "strong"), c.bending, strict=True)
    ]
    values += [("torsional stiffness", "N m^2", 1.0 / F[5, 5])]
    values += [("shear stiffness, flap", "N", K[0]), ("shear stiffness, edge", "N", K[1])]
    for name, point in (("shear centre", c.shear), ("tension centre", c.tension), ("centre of mass", c.mass)):
        values += [(f"{name} {axis}", "m", value) for axis, value in zip("xy", point, strict=True)]
    values += [("principal direction, towards feather", "deg", np.degrees(c.direction))]
    values += [("bend-twist coupling, flap", "-", -F[4, 5] / np.sqrt(F[4, 4] * F[5, 5]))]
    return [(name, unit, float(np.real(value))) for name, unit, value in values]


def _print(station: float, layup: Layup, found: dict[str, SectionModel]) -> None:
    from meltemi.report.tables import number

    columns = [_quantities(made) for made in found.values()]
    head = ["", "unit", *(NAMES[kind] for kind in found), *(["difference"] if len(columns) > 1 else [])]
    chord, rows = layup.chord.at(station), []
    for row in zip(*columns, strict=True):
        name, unit, first = row[0]
        scale, shown = (1e-6, f"M{unit}") if unit in ("N", "N m^2") else (1.0, unit)
        cells = [number(scale * value if abs(value) > 1e-5 * chord else 0.0) for _, _, value in row]
        if len(row) > 1:
            change = row[1][2] - first
            if unit == "m":
                cells.append(f"{100.0 * change / chord:+.1f} % chord")
            else:
                cells.append(f"{change:+.2f}" if unit in ("deg", "-") else f"{100.0 * change / first:+.1f} %")
        rows.append([name, shown, *cells])
    print_table(f"{layup.name}: station {station:g}", head, rows, 2)
