"""Variables of a turbine's unit that a master sets and reads, and their places in the arrays of a run."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from xml.etree.ElementTree import Element, SubElement

from meltemi.aero.tables import AeroParameters
from meltemi.compiler import Table
from meltemi.control.actuators import Actuators
from meltemi.control.signals import Demands, Measurements
from meltemi.core.errors import InputError
from meltemi.environment.conditions import Conditions
from meltemi.simulation.simulate import Simulation
from meltemi.wind.velocity import WindNow

BASE: dict[str, dict[str, int]] = {
    "N": {"kg": 1, "m": 1, "s": -2},
    "W": {"kg": 1, "m": 2, "s": -3},
    "J": {"kg": 1, "m": 2, "s": -2},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "var": {"kg": 1, "m": 2, "s": -3},
    "Hz": {"s": -1},
    **{name: {name: 1} for name in ("kg", "m", "s", "A", "K", "rad")},
}
"""Exponents of the base units of FMI."""


@dataclass(frozen=True)
class FmuVariable:
    """Variable of the unit, a float.

    Attributes:
      name, unit, about: as the model description has them.
      causality: ``input``, ``output``, or ``parameter``, which is tunable.
      array, index: array of the case and index in it; ``""`` is the vector of all signals.
    """

    name: str
    unit: str
    about: str
    causality: str
    array: str
    index: tuple[int, ...]


def base_units(unit: str) -> dict[str, int]:
    """Exponents of the base units of a unit such as ``N m/rad``; empty for numbers."""
    exponents: dict[str, int] = {}
    for sign, name, power in re.findall(r"([ /]?)([A-Za-z]+)(?:\^(\d))?", unit):
        for base, exponent in BASE.get(name, {}).items():
            exponents[base] = exponents.get(base, 0) + exponent * int(power or 1) * (-1 if sign == "/" else 1)
    return {base: exponent for base, exponent in exponents.items() if exponent}


def variables_of(simulation: Simulation, kind: str) -> list[FmuVariable]:
    """Variables of the unit of a run, in the order of their value references.

    Args:
      kind: kind of the controller, as in case files. With ``fixed`` the master sets the demands. Inputs exist only
        where they act: the power reference under power control, voltage and reactive power with an electrical system.
    """
    case, model = simulation.case, simulation.model
    blades, variables = model.n_blades, list[FmuVariable]()

    def add(
        causality: str, array: str, table: type[Table], names: dict[str, str], *column: int, first: bool = False
    ) -> None:
        rows = {row.name: row for row in table.rows}
        for name, shown in names.items():
            row, place = rows[name], table.index(name)
            index = (*column, place) if first else (place, *column)
            variables.append(FmuVariable(shown, row.unit, row.doc, causality, array, index))

    if len(case["series"]) == 1 and case["wind"][0] == 0.0:  # steady wind, which the master may change
        add("input", "series", WindNow, {"speed": "wind_speed", "direction": "wind_direction"}, 0, first=True)
        add("parameter", "series", WindNow, {"exponent": "shear_exponent"}, 0, first=True)
    if case["conditions"].shape[1] == 1:
        grid = {"grid_frequency": "grid_frequency"}
        if model.turbine.electrical is not None and model.options.electrical != "ideal":
            grid |= {"grid_voltage": "grid_voltage", "reactive_power": "grid_reactive_power"}
        if kind == "power":
            grid |= {"power_reference": "power_reference"}
        add("input", "conditions", Conditions, grid, 0)
        if "aero" in case.arrays and len(case["aero"]) == len(AeroParameters):
            add("parameter", "aero", AeroParameters, {"air_density": "air_density"})
    if kind == "fixed":
        pitch, flaps = [f"pitch_{b + 1}" for b in range(blades)], model.turbine.flaps
        names = ["generator_torque", *pitch, "brake", *(["yaw_rate"] if model.options.yaw == "driven" else [])]
        if flaps:
            names += [name for name in Demands.names if _is_flap_of(name, len(flaps), blades)]
        add("input", "demands", Demands, {name: f"demand.{name}" for name in names})
    offsets = {f"pitch_offset_{b + 1}": f"pitch_offset_{b + 1}" for b in range(blades)}
    add("input", "actuators", Actuators, offsets)
    reports = [name for name in Measurements.names if _is_available(name, blades, len(model.turbine.flaps))]
    add("output", "measured", Measurements, {name: f"measured.{name}" for name in reports})
    variables.extend(_channels(simulation))
    return variables


def _is_flap_of(name: str, flaps: int, blades: int) -> bool:
    """Whether a demand is that of a flap of the turbine."""
    if not name.startswith("flap"):
        return False
    j, b = (int(number) for number in re.findall(r"\d+", name)) if name.count("_") > 1 else (1, int(name[-1]))
    return j <= flaps and b <= blades


def _is_available(name: str, blades: int, flaps: int) -> bool:
    """Whether a measurement exists for the turbine and is that of a sensor or of the grid."""
    if name in ("callback", "n_blades", "request", "power_limit") or (name.startswith("flap") and not flaps):
        return False
    number = re.fullmatch(r"(?:pitch|out_of_plane_moment|in_plane_moment)_(\d)", name)
    return int(number[1]) <= blades if number else True


def _channels(simulation: Simulation) -> Iterator[FmuVariable]:
    later = {channel for each in simulation.derived for channel in each.channels}
    for channel in simulation.channels:
        if channel in later:
            raise InputError(f"channels: {channel.name!r} is computed after the time loop, and no output of a unit")
        name = channel.name.replace(" ", "_")
        yield FmuVariable(name, channel.unit, channel.description, "output", "", (simulation.case.place(channel),))


def model_description(
    variables: list[FmuVariable], starts: list[float], version: str, about: dict[str, str], experiment: dict[str, str]
) -> Element:
    """The model description of FMI 2.0 or 3.0.

    Args:
      variables: the value reference of each is its index; a fixed text, ``wind_file``, follows
        them, and in FMI 3.0 ``time``.
      starts: values at the start.
      version: ``2.0`` or ``3.0``.
      about: modelName, modelIdentifier, token, description, generationTool, generationDateAndTime.
      experiment: stopTime and stepSize.
    """
    two = version == "2.0"
    token = "guid" if two else "instantiationToken"
    keys = ("modelName", "description", "generationTool", "generationDateAndTime")
    attributes = {key: about[key] for key in keys} | {token: about["token"], "fmiVersion": version}
    root = Element("fmiModelDescription", attributes, variableNamingConvention="structured")
    state = "FMUstate" if two else "FMUState"
    can = ["needsExecutionTool", "canHandleVariableCommunicationStepSize"]
    can += [f"canGetAndSet{state}", f"canSerialize{state}"]
    can += ["canNotUseMemoryManagementFunctions"] if two else []
    SubElement(root, "CoSimulation", dict.fromkeys(can, "true"), modelIdentifier=about["modelIdentifier"])
    units = SubElement(root, "UnitDefinitions")
    for unit in sorted({v.unit for v in variables} - {"-", ""}):
        exponents = {base: str(exponent) for base, exponent in base_units(unit).items()}
        SubElement(SubElement(units, "Unit", name=unit), "BaseUnit", exponents)
    categories = SubElement(root, "LogCategories")
    for name in ("Warning", "Discard", "Error", "Fatal"):
        SubElement(categories, "Category", name=f"logStatus{name}")
    SubElement(categories, "Category", name="logAll")
    SubElement(root, "DefaultExperiment", {"startTime": "0"} | experiment)
    listed = SubElement(root, "ModelVariables")
    for i, v in enumerate(variables):
        _variable(listed, two, i, v, starts[i])
    text = {"name": "wind_file", "valueReference": str(len(variables))}
    text |= {"causality": "parameter", "variability": "fixed"}
    text |= {"description": "wind file in the place of the wind inputs; empty: none", "initial": "exact"}
    if two:
        SubElement(SubElement(listed, "ScalarVariable", text), "String", start="")
    else:
        SubElement(SubElement(listed, "String", text), "Start", value="")
        clock = {"name": "time", "valueReference": str(len(variables) + 1), "unit": "s"}
        SubElement(listed, "Float64", clock | {"causality": "independent", "variability": "continuous"})
    structure = SubElement(root, "ModelStructure")
    outputs = [i for i, v in enumerate(variables) if v.causality == "output"]
    if two:
        for group in ("Outputs", "InitialUnknowns"):
            parent = SubElement(structure, group)
            for i in outputs:
                SubElement(parent, "Unknown", index=str(i + 1))
    else:
        for tag in ("Output", "InitialUnknown"):
            for i in outputs:
                SubElement(structure, tag, valueReference=str(i))
    return root


def _variable(listed: Element, two: bool, i: int, v: FmuVariable, start: float) -> None:
    common = {"name": v.name, "valueReference": str(i), "causality": v.causality, "description": v.about}
    common["variability"] = "tunable" if v.causality == "parameter" else "discrete"
    number = {} if v.unit in ("-", "") else {"unit": v.unit}
    if v.causality == "output":
        common["initial"] = "calculated"
    else:
        number["start"] = repr(float(start))
        if v.causality == "parameter":
            common["initial"] = "exact"
    if two:
        SubElement(SubElement(listed, "ScalarVariable", common), "Real", number)
    else:
        SubElement(listed, "Float64", common | number)
