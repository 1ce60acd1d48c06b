"""Linear models of the turbine about its steady operation.

    dx/dt = A x + B u,   y = C x + D u          (deviations from the operating point)

States are the free coordinates and their velocities, amplitudes and rates of a gearbox's modes, and the states of
inflow, stall, pitch actuators and electrical system. The rotor azimuth is not a state: the matrices depend on it. At a
fixed azimuth they are in blade coordinates; in the fixed frame blade quantities are collective, cosine and sine
components, and the matrices are averaged over the azimuth.

Reference: docs/theory/simulation.md (M-20 to M-26); Bir (2008), NREL/CP-500-42553.
"""

from __future__ import annotations

import re
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from meltemi.aero import stall
from meltemi.aero.stall.section import model_weight
from meltemi.aero.tables import AeroNode, AeroOptions, BladeFlow, InflowState, StallState
from meltemi.analyses.modes import Mode
from meltemi.compiler import N_DERIVATIVES, Table, View
from meltemi.control import actuator_models
from meltemi.control.actuators import Actuators, FlapActuators
from meltemi.core.display import quantity
from meltemi.core.errors import InputError, UnsupportedError, did_you_mean
from meltemi.core.extras import need
from meltemi.core.representation import Card, Fold
from meltemi.core.shown import Brief
from meltemi.core.threads import one_blas_thread
from meltemi.maths.multiblade import TURNING, by_components, to_components
from meltemi.simulation.case import Case
from meltemi.simulation.channels import Channel, unit_of_coordinate
from meltemi.simulation.model import Model, Stations
from meltemi.simulation.operating_point import OperatingPoint
from meltemi.simulation.orbit import SAMPLES
from meltemi.simulation.parts import LinearVariable, Place
from meltemi.simulation.rotors import kind_of
from meltemi.wind.velocity import WindNow

Float = NDArray[np.float64]

AZIMUTHS = 12
"""Rotor positions in a third of a revolution over which the fixed frame's matrices are averaged."""
ITERATIONS = 20
"""Iterations of the momentum balance, enough for its derivatives to converge as well."""
STRUCTURAL = 0.5
"""Smallest share of coordinates and velocities in the participation factors of a structural mode."""
PARTS = ("collective", "cosine", "sine")


@dataclass(frozen=True, repr=False, eq=False)
class LinearModel(Brief):
    """A linear model for deviations from steady operation, in SI units.

    Attributes:
      A, B, C, D: (n, n), (n, inputs), (outputs, n), (outputs, inputs).
      states, inputs, outputs: names; in the fixed frame those of blades end with ``collective``, ``cosine``, ``sine``.
      state_units, input_units, output_units: SI units.
      x0, u0, y0: values at the operating point, to which deviations are added; azimuthal averages in the fixed frame.
      azimuth: [rad] azimuth of blade 1, or None in the fixed frame.
      point: the operating point.
    """

    A: Float = field(repr=False)
    B: Float = field(repr=False)
    C: Float = field(repr=False)
    D: Float = field(repr=False)
    states: tuple[str, ...] = field(repr=False)
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    state_units: tuple[str, ...] = field(repr=False)
    input_units: tuple[str, ...] = field(repr=False)
    output_units: tuple[str, ...] = field(repr=False)
    x0: Float = field(repr=False)
    u0: Float = field(repr=False)
    y0: Float = field(repr=False)
    azimuth: float | None
    point: OperatingPoint

    def __repr__(self) -> str:
        return f"<LinearModel of {self._size()}, {self._frame()}>"

    def _size(self) -> str:
        return f"{len(self.states)} states, {len(self.inputs)} inputs, {len(self.outputs)} outputs"

    def _frame(self) -> str:
        return "fixed frame" if self.azimuth is None else f"blade 1 at {np.degrees(self.azimuth):g} deg"

    def card(self) -> Card:
        """Size and operating point, modes, and the names of inputs, outputs and states."""

        facts = [("size", self._size()), ("frame", self._frame())]
        facts += [(name.replace("_", " "), text) for name, text in self.point.facts().items()]
        rows = [
            [f"{m.frequency / (2.0 * np.pi):.4g}", f"{100.0 * m.damping:.3g}", m.participation(2)] for m in self.modes()
        ]
        sections = [Fold("Modes", rows, ["Hz", "damping %", "largest amplitudes"], note=str(len(rows)))]
        for what in ("input", "output", "state"):
            names, units = getattr(self, f"{what}s"), getattr(self, f"{what}_units")
            values = getattr(self, {"input": "u0", "output": "y0", "state": "x0"}[what])
            shown = [
                [name, unit, quantity(float(value), unit, name)]
                for name, unit, value in zip(names, units, values, strict=True)
            ]
            head = ["name", "SI unit", "at the operating point"]
            sections.append(Fold(f"{what.capitalize()}s", shown, head, note=str(len(shown))))
        return Card("LinearModel", "deviations from steady operation, in SI units", facts, sections)

    @one_blas_thread
    def modes(self, structural: float = STRUCTURAL) -> list[Mode]:
        """Oscillating modes of the structure, lowest frequency first; their shapes contain only the coordinates.

        Args:
          structural: smallest share of coordinates and velocities in the participation factors; 0 lists all modes,
            including purely aerodynamic ones.
        """
        from scipy.linalg import eig

        value, left, right = eig(self.A, left=True)
        factor = np.abs(left.conj() * right)
        motion = np.array([re.match(r"[qv] ", name) is not None for name in self.states])
        place = np.flatnonzero([name.startswith("q ") for name in self.states])
        share = factor[motion].sum(axis=0) / factor.sum(axis=0)
        names = tuple(self.states[i][2:] for i in place)
        energy = factor[place] + factor[[self.states.index(f"v {name}") for name in names]]
        modes = []
        for i in np.argsort(np.abs(value)):
            if value[i].imag > 1e-6 and share[i] >= structural and len(place):
                shape = right[place, i]
                shape = shape / shape[np.argmax(np.abs(shape))]
                damping = float(-value[i].real / abs(value[i]))
                modes.append(Mode(float(abs(value[i])), damping, names, shape, energy[:, i]))
        return modes

    @one_blas_thread
    def response(self, s: ArrayLike) -> NDArray[np.complex128]:
        """Transfer matrices C (s I - A)^-1 B + D.

        Args:
          s: (k,) complex frequencies [rad/s], i w for a harmonic signal. In the fixed frame s = i w + i n W belongs to
            a signal of the blades whose amplitude varies with w, see ``controllers.tuning``.

        Returns:
          (k, outputs, inputs), output unit over input unit.
        """
        from scipy.linalg.lapack import ztrtrs

        # A = U T U*, T upper triangular: no inverse is needed, and each frequency costs a back substitution
        T, U = self._schur
        left, right = self.C @ U, np.asfortranarray(U.conj().T @ self.B)
        shifted, diagonal = np.asfortranarray(-T), np.diag(T).copy()
        responses = []
        for at in np.atleast_1d(np.asarray(s)):
            np.fill_diagonal(shifted, at - diagonal)
            x, pole = ztrtrs(shifted, right)
            if pole:
                raise np.linalg.LinAlgError(f"response: {at} is a pole")
            responses.append(left @ x + self.D)
        return np.array(responses, dtype=np.complex128)

    @property
    def eigenvalues(self) -> NDArray[np.complex128]:
        """(n,) [rad/s] eigenvalues of A."""
        return np.diag(self._schur[0])

    @cached_property
    @one_blas_thread
    def _schur(self) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        from scipy.linalg import schur

        T, U = schur(self.A, output="complex")
        return T, U

    def to_scipy(self) -> Any:
        """The model as ``scipy.signal.StateSpace``."""
        from scipy.signal import StateSpace

        return StateSpace(self.A, self.B, self.C, self.D)

    def to_control(self) -> Any:
        """The model as ``control.StateSpace``, with names.

        Raises:
          InputError: the package ``control`` is not installed.
        """
        need("to_control", "control")
        import control

        names = {key: list(getattr(self, key)) for key in ("states", "inputs", "outputs")}
        return control.ss(self.A, self.B, self.C, self.D, name="meltemi", **names)


@one_blas_thread
def linearise(
    model: Model[Any],
    point: OperatingPoint,
    inputs: Sequence[str] = ("generator_torque", "pitch", "wind_speed"),
    outputs: Sequence[str] = ("rotor_speed", "tower_top_fore_aft"),
    *,
    azimuth: float | None = None,
    azimuths: int = AZIMUTHS,
    progress: Callable[[float], None] | None = None,
) -> LinearModel:
    """Linear model about steady operation.

    Args:
      point: steady operation from ``operating_point`` with the same model.
      inputs: ``generator_torque``, ``pitch`` (of all blades), ``pitch_1`` to ``pitch_3``, ``wind_speed`` (uniform),
        ``vertical_wind``, ``wind_direction``, ``horizontal_shear``, ``vertical_shear`` (linear, as in a
        ``WindSeries``), ``shear_exponent``, ``yaw``, ``yaw_rate`` (of the yaw drive), ``flap_1_1`` (flap, blade) and so
        on. Pitch and flaps are demands. With an electrical system the generator torque is a demand as well, and
        ``reactive_power``, ``grid_voltage`` and ``grid_frequency`` are further inputs.
      outputs: channels except the azimuth, by meltemi's names or OpenFAST's.
      azimuth: [rad] azimuth of blade 1, for the model at this azimuth; by default the model in the fixed frame. There,
        a channel or input of one blade adds those of the other two.
      azimuths: number of rotor positions in a third of a revolution over which the matrices are averaged; a divisor of
        12.
      progress: callback with the completed fraction.

    Raises:
      InputError: a name is unknown.
      UnsupportedError: the fixed frame is requested for a rotor without three blades.
    """
    fixed = azimuth is None
    if fixed and model.n_blades != 3:
        raise UnsupportedError("linearise: the fixed frame needs three blades; give azimuth for rotating axes")
    if azimuths < 1 or SAMPLES % azimuths:
        raise InputError(f"linearise: azimuths must divide {SAMPLES}, found {azimuths!r}")
    case = linear_case(model, point)
    kind = kind_of(model)
    channels = kind.channels(model, Stations())
    outputs = [kind.channel(name, model, channels).name for name in outputs]
    for name in outputs:
        if any(channels[name].source[0] in part.afterwards for part in model.parts):
            raise InputError(f"linearise: {name!r} is computed after the time loop, and no output of a linear model")
    u = _inputs(case, point, _of_all_blades(inputs) if fixed else inputs)
    y = _outputs(case, [channels[name] for name in (_of_all_blades(outputs) if fixed else outputs)])
    places = [azimuth] if azimuth is not None else list(2.0 * np.pi / 3.0 / azimuths * np.arange(azimuths))
    x = _states(case, point, places, "yaw_rate" in inputs)
    n, m = len(x), len(u)
    turns = np.array([float(s.name in ("v generator", "v drivetrain")) for s in x])
    of_x, of_u, of_y = (_triples(variables if fixed else ()) for variables in (x, u, y))
    total: Float = np.zeros((n + len(y), n + m))
    x0, y0 = np.zeros(n), np.zeros(len(y))
    for i, psi in enumerate(places):
        if progress is not None:
            progress(i / len(places))
        point.put(case, psi)
        case.begin_parts()
        state = np.array([case[s.moves[0][0][0]].flat[s.moves[0][0][1]] for s in x])
        J = jacobian(case, (*x, *u), (*x, *y))
        shown = np.array([case.signals.vector[v.shows[1]] for v in y])
        if fixed:
            for values, triples in ((state, of_x), (shown, of_y), (J, np.concatenate([of_x, n + of_y]))):
                to_components(values, triples, psi)
            by_components(J, np.concatenate([of_x, n + of_u]), psi)
            # dz/dt = inv(T) dx/dt - speed inv(T) T' z: the frame rotates with the present speed, which is a state
            J[of_x[:, :, None], of_x[:, None, :]] -= point.rotor_speed * TURNING
            J[of_x, :n] -= (state[of_x] @ TURNING.T)[..., None] * turns
        total += J / len(places)
        x0, y0 = x0 + state / len(places), y0 + shown / len(places)
    u0 = np.array([v.value for v in u])
    if fixed:
        to_components(u0, of_u, 0.0)
    names = [tuple(_fixed_name(s.name) if fixed else s.name for s in v) for v in (x, u, y)]
    units = [tuple(s.unit for s in v) for v in (x, u, y)]
    blocks = (total[:n, :n], total[:n, n:], total[n:, :n], total[n:, n:])
    return LinearModel(*blocks, names[0], names[1], names[2], units[0], units[1], units[2], x0, u0, y0, azimuth, point)


def linear_case(model: Model[Any], point: OperatingPoint) -> Case:
    """A case in dual numbers, with the momentum balance converged to rounding."""
    case = Case(model, point.wind, numbers="duals")
    if "aero_options" in case.arrays:
        case["aero_options"][AeroOptions.index("iterations")] = ITERATIONS
    return case


def jacobian(case: Case, columns: Sequence[LinearVariable], rows: Sequence[LinearVariable]) -> Float:
    """(rows, columns) exact derivatives of state derivatives and outputs with respect to states and inputs.

    Args:
      case: case of duals, at the operating point.
      columns: states and inputs, with the change of the case for a unit change of each (``moves``).
      rows: states and outputs, with the entries of their derivatives and values after an evaluation (``shows``).
    """
    J: Float = np.zeros((len(rows), len(columns)))
    loads = any(row.shows[0] == "signals" for row in rows)
    slopes, shown = case.slopes, defaultdict[str, list[tuple[int, int]]](list)
    for r, row in enumerate(rows):
        shown[row.shows[0]].append((r, row.shows[1]))
    places = [(array, *np.array(pairs).T) for array, pairs in shown.items()]
    for first in range(0, len(columns), N_DERIVATIVES):
        some = columns[first : first + N_DERIVATIVES]
        for name in {"memory", "flow", "bound"} & slopes.keys():
            slopes[name][...] = (
                0.0  # the start value of the solver and the loads of the last evaluation are no variables
            )
        for k, column in enumerate(some):
            for (array, i), weight in column.moves:
                slopes[array].reshape(-1, N_DERIVATIVES)[i, k] = weight
        evaluate_rates(case, loads)
        for array, r, i in places:
            J[r, first : first + len(some)] = slopes[array].reshape(-1, N_DERIVATIVES)[i, : len(some)]
        for column in some:
            for (array, i), _ in column.moves:
                slopes[array].reshape(-1, N_DERIVATIVES)[i] = 0.0
    return J


def evaluate_rates(case: Case, loads: bool) -> None:
    """Time derivatives of all states, and section loads if outputs need them."""
    case.drive_rates()
    case.evaluate(0.0)
    case.rates()
    if loads:
        case.loads(0.0)


def _states(case: Case, point: OperatingPoint, azimuths: Sequence[float], yaw: bool) -> list[LinearVariable]:
    """All free states."""
    model, names = case.model, case.model.coordinates
    _, generator, torsion = model.rows
    free = [i for i in range(len(names)) if case["locked"][i] == 0.0]
    unit = [unit_of_coordinate(name) for name in names]
    x = []
    for i in (i for i in free if i != generator):
        # the rotor azimuth is prescribed: torsion of the shaft moves the generator backwards
        moves: tuple[tuple[Place, float], ...] = ((("q", i), 1.0),)
        moves += ((("q", generator), -1.0),) if i == torsion else ()
        x.append(LinearVariable(f"q {names[i]}", unit[i], moves, ("v", i)))
    x += [LinearVariable(f"v {names[i]}", f"{unit[i]}/s", ((("v", i), 1.0),), ("a", i)) for i in free]
    for row, begins, units, rate in (("angle", "q", "rad", "rate"), ("rate", "v", "rad/s", "acceleration")):
        for k in range(case["gears"].shape[1]):
            states, grows = (_place(case, "gears", r, k) for r in (row, rate))
            x.append(LinearVariable(f"{begins} gear mode {k + 1}", units, ((states, 1.0),), grows))
    for array, table, active in _air(case, point, azimuths):
        for f, b, n in np.argwhere(active):
            entry = table.rows[f]
            place = int(np.ravel_multi_index((f, b, n), case[array].shape))
            name = f"blade {b + 1} node {n + 1} {array} {entry.name}"
            x.append(LinearVariable(name, entry.unit, (((array, place), 1.0),), (f"d_{array}", place)))
    x += _actuator_states(case, "pitch", "pitch", (), _pitch_actuator(case))
    for j in range(model.n_flaps):
        x += _actuator_states(case, f"flap {j + 1}", "flap", (j,), _flap_actuator(case, j))
    x += [variable for part in case.parts for rows in part.states() for variable in rows.variables()]
    if yaw:
        order, pace = (_place(case, "drive", name) for name in ("yaw_command", "yaw_command_rate"))
        x.append(LinearVariable("yaw command", "rad", ((order, 1.0),), pace))
    return x


def _air(
    case: Case, point: OperatingPoint, azimuths: Sequence[float]
) -> tuple[tuple[str, type[Table], NDArray[np.bool_]], ...]:
    """States of inflow and stall, and mask (states, blades, nodes) of the nodes that have them."""
    if not case.aero_state.views:
        return ()
    lagging, stalling = _lagging(case), _stalling(case, point, azimuths)
    model = stall.MODELS[case["aero_options"][AeroOptions.index("stall")]]
    used = np.array([name in model.STATES for name in StallState.names])
    return (
        ("inflow", InflowState, np.broadcast_to(lagging, (len(InflowState), *lagging.shape))),
        ("stall", StallState, used[:, None, None] & stalling),
    )


def _pitch_actuator(case: Case) -> tuple[float, ...]:
    """Coefficients of the linear equation of the pitch actuators."""
    v = View(Actuators, case["actuators"])
    model = actuator_models.MODELS[int(v["pitch_model"])]
    return tuple(model.coefficients(float(v["pitch_frequency"]), float(v["pitch_damping"])))


def _flap_actuator(case: Case, j: int) -> tuple[float, ...]:
    """Coefficients of the linear equation of the actuator of flap ``j``."""
    v = View(FlapActuators, case["flap_actuators"])
    model = actuator_models.MODELS[int(v["model"][j])]
    return tuple(model.coefficients(float(v["frequency"][j]), float(v["damping"][j])))


def _place(case: Case, array: str, field: str, *index: int) -> Place:
    row = case.tables[array].index(field)
    return (array, int(np.ravel_multi_index((row, *index), case[array].shape)))


MOTION = ("angle", "rate", "acceleration")
ACTUATOR_STATES = (("angle", "rate", "", "rad"), ("rate", "acceleration", " rate", "rad/s"))


def _actuator_states(
    case: Case, name: str, array: str, which: tuple[int, ...], coefficients: tuple[float, ...]
) -> list[LinearVariable]:
    """Angle and, for second order, rate of actuators, one per blade."""
    x, highest = [], MOTION[len(coefficients)]
    for c, (row, rate, what, unit) in zip(coefficients, ACTUATOR_STATES, strict=False):
        for b in range(case.model.n_blades):
            states, push, grows = (_place(case, array, r, *which, b) for r in (row, highest, rate))
            x.append(LinearVariable(f"blade {b + 1} {name}{what}", unit, ((states, 1.0), (push, -c)), grows))
    return x


def _demand(case: Case, array: str, index: tuple[int, ...], coefficients: tuple[float, ...]) -> tuple[Place, float]:
    """Entry that a demand of an actuator moves, and by how much."""
    return _place(case, array, MOTION[len(coefficients)], *index), coefficients[0] if coefficients else 1.0


def _lagging(case: Case) -> NDArray[np.bool_]:
    """(blades, nodes) mask of the nodes with dynamic inflow."""
    options = case["aero_options"]
    none = options[AeroOptions.index("inflow")] == 0 or options[AeroOptions.index("wake")] == 0
    none |= any(part.replaces_momentum for part in case.parts)
    return (case["aero_nodes"][AeroNode.index("end")] == 0.0) & (not none)


def _stalling(case: Case, point: OperatingPoint, azimuths: Sequence[float]) -> NDArray[np.bool_]:
    """(blades, nodes) mask of the nodes with dynamic stall at all azimuths."""
    nodes, flow = case["aero_nodes"], case["flow"]
    weight = np.full(nodes.shape[1:], float(case["aero_options"][AeroOptions.index("stall")] != 0))
    for psi in azimuths:
        point.put(case, psi)
        case.evaluate(0.0)
        for (b, n), now in np.ndenumerate(weight):
            alpha, speed = flow[BladeFlow.index("alpha"), b, n], flow[BladeFlow.index("speed"), b, n]
            polar = int(nodes[AeroNode.index("polar"), b, n])
            weight[b, n] = min(now, model_weight(alpha, speed, polar, case.plain))
    # over a revolution all blades pass every azimuth
    active: NDArray[np.bool_] = np.broadcast_to(weight.min(axis=0) > 0.0, weight.shape)
    return active


def _inputs(case: Case, point: OperatingPoint, names: Sequence[str]) -> list[LinearVariable]:
    model, B = case.model, case.model.n_blades
    wind = point.wind
    actuator = _pitch_actuator(case)
    pitch = [(_demand(case, "pitch", (b,), actuator),) for b in range(B)]
    torque = _place(case, "drive", "generator_torque")
    known = {
        "generator_torque": LinearVariable("", "N m", ((torque, 1.0),), value=point.generator_torque),
        "pitch": LinearVariable("", "rad", tuple(p for (p,) in pitch), value=point.pitch),
        **{f"pitch_{b + 1}": LinearVariable("", "rad", pitch[b], value=point.pitch) for b in range(B)},
        "yaw": LinearVariable("", "rad", ((_place(case, "drive", "yaw_command"), 1.0),)),
        "yaw_rate": LinearVariable("", "rad/s", ((_place(case, "drive", "yaw_command_rate"), 1.0),)),
    }
    for part in case.parts:
        known |= part.inputs(case, point)
    for j in range(model.n_flaps):
        actuator = _flap_actuator(case, j)
        for b in range(B):
            known[f"flap_{j + 1}_{b + 1}"] = LinearVariable("", "rad", (_demand(case, "flap", (j, b), actuator),))
    columns = {
        "wind_speed": ("gust", wind.speed),
        "vertical_wind": ("vertical", 0.0),
        "wind_direction": ("direction", wind.direction),
        "horizontal_shear": ("horizontal_shear", 0.0),
        "vertical_shear": ("vertical_shear", 0.0),
        "shear_exponent": ("exponent", wind.shear_exponent),
    }
    for name, (column, value) in columns.items():
        i = WindNow.index(column)
        known[name] = LinearVariable("", WindNow.rows[i].unit, ((("series", i), 1.0),), value=value)
    inputs = []
    for name in names:
        if name not in known:
            raise InputError(f"linearise: no input {name!r}: {did_you_mean(name, known)}")
        inputs.append(LinearVariable(name, known[name].unit, known[name].moves, value=known[name].value))
    return inputs


def _outputs(case: Case, channels: Sequence[Channel]) -> list[LinearVariable]:
    outputs = []
    for channel in channels:
        array, what = channel.source
        if channel.wrap or array == "demands" or (array, what) in (("q", "generator"), ("summary", "time")):
            raise InputError(f"linearise: {channel.name!r} is not an output of a linear model")
        outputs.append(LinearVariable(channel.name, channel.unit, shows=("signals", case.place(channel))))
    return outputs


def _blade_of(name: str) -> tuple[str, int, str] | None:
    """A name split into prefix, number of the blade and suffix; None for a quantity without a blade."""
    match = re.fullmatch(r"((?:[qv] )?blade )([123])( .*)", name) or re.fullmatch(r"(.*_)([123])()", name)
    return (match[1], int(match[2]), match[3]) if match else None


def _of_all_blades(names: Sequence[str]) -> list[str]:
    """The names, with those of a blade completed to all three blades, each once."""
    completed: dict[str, None] = {}
    for name in names:
        of = _blade_of(name)
        completed.update(dict.fromkeys([name] if of is None else [f"{of[0]}{b}{of[2]}" for b in (1, 2, 3)]))
    return list(completed)


def _triples(variables: Sequence[LinearVariable]) -> NDArray[np.intp]:
    """(quantities, 3) indices of the three blades for each blade quantity."""
    groups: dict[tuple[str, str], list[int]] = {}
    for i, variable in enumerate(variables):
        if of := _blade_of(variable.name):
            groups.setdefault((of[0], of[2]), []).append(i)
    return np.array(list(groups.values()), dtype=np.intp).reshape(-1, 3)


def _fixed_name(name: str) -> str:
    """Name in the fixed frame: ``q blade 1 1st flap`` to ``q 1st flap collective``, ``pitch_2`` to ``pitch_cosine``."""
    of = _blade_of(name)
    if of is None:
        return name
    return f"{of[0]}{PARTS[of[1] - 1]}" if not of[2] else f"{of[0].replace('blade ', '')}{of[2][1:]} {PARTS[of[1] - 1]}"
