"""The electrical system by itself: records, exact steps, steady operation, balance of power, protection."""

from __future__ import annotations

import cmath
import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import meltemi
import meltemi.compiler.record_types
from meltemi.compiler import View, kernel
from meltemi.electrical.advance import chopper, electric_advance, electric_begin, electric_rates
from meltemi.electrical.circuit import circuit, drive
from meltemi.electrical.control import stator_reference
from meltemi.electrical.system import LINE, ElectricalSystem, size_electrical
from meltemi.electrical.tables import (
    N_STATES,
    TRIPS,
    Electrical,
    ElectricState,
    electrical_array,
)
from meltemi.maths.phasors import Phasor

SYSTEM: ElectricalSystem = meltemi.load_turbine("pmsg20mw").electrical
SPEED, TORQUE = 0.75, 20e6 / 0.75
FLOWS = "copper_loss iron_loss converter_loss filter_loss chopper_power stored_power grid_power".split()


class Bench:
    """An electrical system under given inputs."""

    def __init__(self, system: ElectricalSystem = SYSTEM, dt: float = 0.01, torque: float = TORQUE) -> None:
        self.x, self.dt, self.time = ElectricState.zeros(), dt, 0.0
        arrays = {"electrical": electrical_array(system), "electric": self.x, "d_electric": ElectricState.zeros()}
        self.system = Electrical("floats", arrays)
        self.now, self.slope = View(ElectricState, self.x), View(ElectricState, arrays["d_electric"])
        self.inputs = [torque, 0.0, SPEED, 1.0, 50.0]
        electric_begin(dt, *self.inputs, self.system)

    def march(self, duration: float, **changes: float) -> list[np.ndarray]:
        names = "torque reactive speed voltage frequency".split()
        for name, value in changes.items():
            self.inputs[names.index(name)] = value
        rows = []
        for _ in range(round(duration / self.dt)):
            electric_advance(self.dt, *self.inputs, self.system)
            self.time += self.dt
            rows.append(self.x.copy())
        return rows

    def advanced(self, x: np.ndarray, dt: float) -> np.ndarray:
        """States a step after ``x``."""
        self.x[:] = x
        electric_advance(dt, *self.inputs, self.system)
        return self.x[:N_STATES].copy()

    def rates(self) -> np.ndarray:
        """Rates of the states; what is recorded stands in ``x``."""
        electric_rates(*self.inputs, self.system)
        return self.slope.array[:N_STATES].copy()

    def residual(self) -> float:
        """Residual of the power balance over rated power."""
        return abs(float(self.now["mechanical_power"]) - sum(float(self.now[name]) for name in FLOWS)) / 20e6


@kernel
def reference(torque: float, w: float, most: float, e: Electrical) -> Phasor:
    return stator_reference(torque, w, most, e.electrical)


@kernel
def dissipated(dc: float, e: Electrical) -> float:
    return chopper(dc, e.electrical)


def column(rows: list[np.ndarray], name: str) -> np.ndarray:
    return np.array(rows)[:, ElectricState.index(name)]


# records --------------------------------------------------------------------------------------------


def test_the_machine_of_table_1_has_its_numbers() -> None:
    m = SYSTEM.machine
    assert LINE * m.rated_emf == pytest.approx(6834.0, rel=1e-4)
    assert m.rated_current == pytest.approx(2389.0, rel=1e-3)
    assert LINE * m.rated_voltage == pytest.approx(8260.0, rel=1e-3)
    assert m.copper_loss == pytest.approx(0.38e6, rel=5e-3)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"filter.resistance": 1.75}, ["1.75 Ohm loses 16.1 MW of 20 MW", "is it 0.00175 Ohm?", "forced: true"]),
        ({"machine.iron_loss": 1e9}, ["machine.iron_loss 1e+03 MW is too high for a rated power of 20 MW"]),
        ({"dc_link.voltage": 11000.0}, ["below the machine's", "8261.4 V line to line", "at least 12045 V"]),
        ({"voltage": 9000.0}, ["too low for the grid"]),
        ({"machine.resistance": 0.5}, ["machine.resistance 0.5 Ohm loses 4.28 MW"]),
        ({"machine_converter.current": 2000.0}, ["machine_converter.current 2000 A is less than the rated 2389.5 A"]),
        ({"frequency": 60.0}, ["frequency 60 Hz is not between"]),
        ({"dc_link.chopper.full": 1.3}, ["dc_link.chopper.full 1.3 must be less than dc_link.highest 1.25"]),
        ({"dc_link.voltage": 11800.0}, ["leaves the control no reserve", "take 11683 V", "at least 12045 V", "3 %"]),
        ({"machine.inductance": 1e-9}, ["machine.inductance 1e-09 H is too small", "at least 0.00014 H"]),
        ({"filter.inductance": 1e-9}, ["filter.inductance 1e-09 H is too small", "at least 0.00013 H"]),
        ({"dc_link.capacitance": 1e-6}, ["1e-06 F holds rated power for 3.91e-06 s", "0.00041 to 2.6 F"]),
        ({"dc_link.capacitance": 1e6}, ["1e+06 F holds rated power for 3.91e+06 s"]),
        ({"dc_link.chopper.resistance": 1e-3}, ["0.001 Ohm acts on 0.005 F faster", "at least 1.64 Ohm"]),
        ({"control.voltage_bandwidth": 50.0}, ["at most a third of current_bandwidth 100 Hz"]),
        ({"control.substep": 0.01}, ["substep 0.01 s is too long for voltage_bandwidth 10 Hz", "at most 0.00796 s"]),
    ],
)
def test_what_cannot_work_is_refused_with_numbers(change: dict[str, float], words: list[str]) -> None:
    with pytest.raises(meltemi.InputError) as error:
        SYSTEM.replace(**change)
    for word in words:
        assert word in str(error.value)
    if "control" not in next(iter(change)):
        assert SYSTEM.replace(forced=True).replace(**change).forced


def test_sizes_by_rule_suit_every_turbine_of_the_library() -> None:
    for power, speed in ((2e6, 188.0), (5.3e6, 122.9), (15.6e6, 0.79), (22.5e6, 0.74)):
        system = size_electrical(power, speed)
        assert not system.problems()
        assert system.machine.rated_power == power
        assert not system.unfit(power / speed, speed)
    assert size_electrical(2e6, 188.0, voltage=1000.0).voltage == 1000.0
    assert size_electrical(2e6, 188.0, pole_pairs=3).machine.pole_pairs == 3
    assert size_electrical(2e6, 188.0, frequency=60.0).ride_through.highest_frequency > 60.0
    assert "less than the rated torque" in SYSTEM.unfit(1.3 * TORQUE, SPEED)
    assert "does not match the rated speed" in SYSTEM.unfit(TORQUE, 2.0 * SPEED)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"rated_speed": 0.0}, "rated_speed must be positive"),
        ({"rated_power": "5e6"}, "rated_power must be positive, found '5e6'"),
        ({"pole_pairs": 0}, "pole_pairs must be an integer of at least 1, found 0"),
        ({"pole_pairs": -3}, "found -3"),
        ({"pole_pairs": 2.5}, "found 2.5"),
        (
            {"resistance": 0.2},
            r"resistance 0.2, inductance 0.5 define an inconsistent system: .* loses 1 MW of 5 MW at .*[^)]$",
        ),
        ({"frequency": 1e9}, "frequency 1e"),
    ],
)
def test_sizes_that_cannot_be_are_told(given: dict[str, Any], words: str) -> None:
    with pytest.raises(meltemi.InputError, match=f"size_electrical: .*{words}"):
        size_electrical(**{"rated_power": 5e6, "rated_speed": 1.2, **given})


def test_a_machine_of_any_voltage_can_be_sized() -> None:
    assert not size_electrical(1e3, 10.0, voltage=1.5).problems()


def test_a_sized_system_that_is_not_used_is_a_misunderstanding() -> None:
    case = {"turbine": "nrel5mw", "wind": {"kind": "steady", "speed": 12.0}, "duration": 1.0, "electrical": "sized"}
    with pytest.raises(meltemi.InputError, match=r"sized has no effect .* set options.electrical: averaged"):
        meltemi.io.LoadCase.model_validate(case)
    assert meltemi.io.LoadCase.model_validate({**case, "options": {"electrical": "averaged"}}).electrical == "sized"


# exact steps ----------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("w", [0.0, 60.0, 314.16])
def test_a_step_of_the_circuit_is_exact(w: float) -> None:
    R, L, h, rate = 0.044, 0.0021, 4e-4, 628.0
    c = circuit(R, L, w, rate, h)
    A = np.array([[-R / L, w], [-w, -R / L]])
    assert np.allclose(expm(A * h), [[c.keep.d, -c.keep.q], [c.keep.q, c.keep.d]], rtol=1e-12, atol=1e-14)
    i, hold, wanted, source = (complex(*x) for x in ((900.0, 300.0), (400.0, 50.0), (1000.0, -100.0), (4300.0, 20.0)))
    end = drive(c, *(Phasor(x.real, x.imag) for x in (i, hold, wanted, source)), 6000.0)
    y = complex(*end.voltage)

    def rates(t: float, x: np.ndarray) -> list[float]:
        now = complex(x[0], x[1])
        d = (y - source - (R + 1j * w * L) * now) / L
        return [d.real, d.imag, now.real, now.imag, abs(now) ** 2]

    x = solve_ivp(rates, (0.0, h), [i.real, i.imag, 0.0, 0.0, 0.0], rtol=1e-11, atol=1e-9).y[:, -1]
    assert np.allclose(end.current, x[:2], rtol=1e-8)
    assert np.allclose(end.mean, x[2:4] / h, rtol=1e-8)
    assert end.square == pytest.approx(x[4] / h, rel=1e-8)


@pytest.mark.parametrize("h", [1e-4, 1e-3])
def test_current_follows_its_reference_with_the_bandwidth_at_every_step(h: float) -> None:
    rate, c = 628.0, circuit(0.044, 0.0275, 60.0, 628.0, h)
    i = hold = Phasor(0.0, 0.0)
    for n in range(1, 11):
        end = drive(c, i, hold, Phasor(100.0, -200.0), Phasor(0.0, 0.0), 1e9)
        i, hold = end.current, end.hold
        assert np.allclose(i, (1.0 - math.exp(-rate * n * h)) * np.array([100.0, -200.0]), rtol=1e-9)
    # a source that jumps is forgotten as fast
    for _ in range(round(20.0 / (rate * h))):
        end = drive(c, i, hold, Phasor(100.0, -200.0), Phasor(500.0, 0.0), 1e9)
        i, hold = end.current, end.hold
    assert np.allclose(i, [100.0, -200.0], rtol=1e-5)


# steady operation -----------------------------------------------------------------------------------


@pytest.mark.slow
def test_steady_operation_is_that_of_phasors() -> None:
    bench = Bench()
    begun = bench.x.copy()
    bench.march(0.5, reactive=4e6)
    m, f, x = SYSTEM.machine, SYSTEM.filter, bench.now
    assert np.allclose(Bench().march(0.2)[-1][:N_STATES], begun[:N_STATES], rtol=1e-6, atol=1e-6)  # it begins at rest
    w = m.pole_pairs * SPEED
    current = 1j * TORQUE / (1.5 * m.pole_pairs * m.flux)
    terminal = 1j * w * m.flux - (m.resistance + 1j * w * m.inductance) * current
    assert complex(*x["stator"]) == pytest.approx(current, rel=1e-6)
    assert x["stator_voltage"] == pytest.approx(abs(terminal), rel=1e-6)
    assert x["copper_loss"] == pytest.approx(1.5 * m.resistance * abs(current) ** 2, rel=1e-6)
    # the grid: what leaves the DC link, found from voltages alone
    volts = 6600.0 * math.sqrt(2.0 / 3.0)
    delivered = complex(*x["grid"])
    power = 1.5 * volts * delivered.conjugate()
    assert x["grid_power"] == pytest.approx(power.real, rel=1e-6)
    assert x["reactive_power"] == pytest.approx(4e6, rel=1e-6)
    assert power.imag == pytest.approx(4e6, rel=1e-6)
    e = volts + (f.resistance + 2j * math.pi * 50.0 * f.inductance) * delivered
    assert x["converter_voltage"] == pytest.approx(abs(e), rel=1e-6)
    lost = sum(c.loss(abs(i)) for c, i in ((SYSTEM.machine_converter, current), (SYSTEM.grid_converter, delivered)))
    assert 1.5 * (terminal * current.conjugate()).real - lost == pytest.approx(
        1.5 * (e * delivered.conjugate()).real, rel=1e-6
    )
    assert cmath.phase(terminal * current.conjugate()) < -0.5  # without current along the flux it takes reactive power
    assert x["dc_link_voltage"] == pytest.approx(12500.0, rel=1e-6)


def test_steady_operation_has_the_voltages_of_its_phasors() -> None:
    m, f, x = SYSTEM.machine, SYSTEM.filter, Bench().now
    w = m.pole_pairs * SPEED
    terminal = 1j * w * m.flux - (m.resistance + 1j * w * m.inductance) * complex(*x["stator"])
    e = SYSTEM.grid_peak + (f.resistance + 2j * math.pi * 50.0 * f.inductance) * complex(*x["grid"])
    assert x["stator_voltage"] == pytest.approx(abs(terminal), rel=1e-12)
    assert x["converter_voltage"] == pytest.approx(abs(e), rel=1e-12)


def test_iron_losses_brake_beside_the_current() -> None:
    bench = Bench(SYSTEM.replace(**{"machine.iron_loss": 100e3}))
    bench.march(0.1)
    assert bench.now["iron_loss"] == pytest.approx(100e3, rel=1e-9)
    assert bench.now["torque"] == pytest.approx(TORQUE, rel=1e-9)
    assert bench.now["stator_q"] < Bench().now["stator_q"]


# transients -----------------------------------------------------------------------------------------

DIPS = [  # depth, duration, number of the protection, seconds after the begin at which it trips
    (0.5, 0.5, 0, 0.0),
    (0.2, 0.25, 0, 0.0),
    (0.2, 0.5, 3, 0.15 + 1.35 * 0.2 / 0.9),
    (0.0, 0.15, 0, 0.0),
    (0.0, 0.5, 3, 0.15),
]


@pytest.mark.parametrize(("depth", "duration", "trip", "after"), DIPS)
def test_dips_are_ridden_through_or_trip_and_power_is_balanced(
    depth: float, duration: float, trip: int, after: float
) -> None:
    bench, dt = Bench(), 0.01
    rows, worst = [], 0.0
    for n in range(150):
        low = 0.2 <= n * dt + 1e-9 < 0.2 + duration
        rows += bench.march(dt, voltage=depth if low else 1.0)
        worst = max(worst, bench.residual())
    assert worst < 1e-12
    assert np.isfinite(rows).all()
    assert column(rows, "trip")[-1] == trip
    dc = column(rows, "dc_link_voltage")
    assert dc.max() < 1.25 * 12500.0
    assert column(rows, "chopper_power").max() > 5e6
    during = rows[20:35]
    support = min(2.0 * (1.0 - depth), 1.0) * SYSTEM.rated_grid_current
    assert column(during, "grid_q")[5:] == pytest.approx(-support, rel=1e-3)
    size = np.hypot(column(rows, "grid_d"), column(rows, "grid_q"))
    assert size.max() < 1.02 * SYSTEM.grid_converter.current
    if trip:
        assert TRIPS[trip] == "grid voltage low for too long"
        assert bench.time - 0.2 - float(bench.now["off_time"]) == pytest.approx(after, abs=1e-3)
        assert abs(column(rows, "torque")[-1]) < 1.0
        # the voltage's return finds both converters cut off
        back = rows[20 + round(duration / dt) :]
        assert np.abs(column(back, "grid_power")).max() < 1.0
        assert np.abs(column(back, "grid_d")).max() < 1e-3
    else:
        assert np.allclose(column(rows, "torque"), TORQUE, rtol=1e-9)  # the rotor does not feel it
        assert column(rows, "grid_power")[-1] == pytest.approx(column(rows, "grid_power")[0], rel=1e-4)


@pytest.mark.parametrize("dt", [0.05, 0.0125, 0.00625, 0.0025])
@pytest.mark.parametrize(("depth", "duration"), [(0.0, 0.15), (0.2, 0.45)])
def test_no_rounding_decides_on_a_dip_of_the_longest_time(dt: float, depth: float, duration: float) -> None:
    for longer in (0.0, 0.0025) if dt == 0.0025 else (0.0,):
        bench = Bench(dt=dt)
        bench.march(duration + longer, voltage=depth)
        bench.march(dt, voltage=1.0)
        assert TRIPS[int(bench.now["trip"])] == ("grid voltage low for too long" if longer else "none")


@pytest.mark.parametrize(("share", "reactive"), [(0.89, 8e6), (0.89, -8e6), (1.2, 8e6), (0.5, 8e6), (0.2, -4e6)])
def test_support_comes_on_top_of_the_reactive_current_before_the_fault(share: float, reactive: float) -> None:
    bench, rated = Bench(), SYSTEM.rated_grid_current
    bench.march(0.1, reactive=reactive)
    before = -reactive / (1.5 * SYSTEM.grid_peak)
    assert bench.now["grid_q"] == pytest.approx(before, rel=1e-6)
    bench.march(0.1, voltage=share)
    expected = min(max(before - 2.0 * (1.0 - share) * rated, -rated), rated)
    assert bench.now["grid_q"] == pytest.approx(expected, rel=2e-3, abs=1.0)
    assert np.hypot(bench.now["grid_d"], bench.now["grid_q"]) < SYSTEM.grid_converter.current * (1.0 + 1e-3)


def test_a_link_that_has_tripped_runs_empty_and_nothing_is_created() -> None:
    bench, worst = Bench(SYSTEM.replace(**{"machine_converter.standing_loss": 5e5}), dt=0.1), 0.0
    for _ in range(180):
        bench.march(0.1, voltage=0.0)
        worst = max(worst, bench.residual())
    assert worst < 1e-12
    assert bench.now["trip"] == 3.0
    assert 0.0 < bench.now["dc_link_voltage"] < 1.0
    assert bench.now["converter_loss"] < 1e-3


@pytest.mark.parametrize(
    "change", [{"dc_link.chopper.resistance": 1e-3}, {"dc_link.capacitance": 1e-6}, {"dc_link.lowest": 0.1}]
)
def test_no_link_gives_more_than_it_has(change: dict[str, float]) -> None:
    """A chopper that empties it within a sub-step, a link that holds nothing, currents that decay out of it."""
    bench, worst = Bench(SYSTEM.replace(forced=True).replace(**change)), 0.0
    for voltage, torque in ((0.2, TORQUE), (1.0, -2.0 * TORQUE), (1.0, -TORQUE), (0.0, 0.0), (1.0, TORQUE)):
        for _ in range(10):
            bench.march(0.01, voltage=voltage, torque=torque)
            worst = max(worst, bench.residual())
            assert np.isfinite(bench.x).all()
            assert bench.now["dc_energy"] > 0.0
    assert worst < 1e-11


def test_what_has_tripped_stays_finite_for_long() -> None:
    """Its currents fall below 1e-150 A, where rounding made their mean square negative and its root no number."""
    bench = Bench(dt=0.05)
    for n in range(100):
        bench.march(0.05, voltage=0.0, speed=SPEED + 2e-4 * n)
    assert TRIPS[int(bench.now["trip"])] == "grid voltage low for too long"
    assert np.isfinite(bench.x).all()
    assert 0.0 < bench.now["dc_link_voltage"] < 1.1 * 12500.0
    assert abs(bench.now["torque"]) < 100.0


def test_without_chopper_the_link_trips_and_nothing_is_created() -> None:
    bench = Bench(SYSTEM.replace(**{"dc_link.chopper": None}))
    for _ in range(30):
        bench.march(0.01, voltage=0.0)
        assert bench.residual() < 1e-12
    assert TRIPS[int(bench.now["trip"])] == "overvoltage of the DC link"
    assert bench.now["dc_link_voltage"] < 1.4 * 12500.0


@pytest.mark.parametrize(
    ("change", "system", "trip"),
    [
        ({"voltage": 1.35}, {}, 4),
        ({"frequency": 46.0}, {}, 5),
        ({"frequency": 53.0}, {}, 5),
        ({"voltage": 0.3}, {"dc_link.chopper.heat": 1e6}, 6),
        ({"torque": -TORQUE}, {"grid_converter.current": 2480.0, "dc_link.lowest": 0.95}, 2),
    ],
)
def test_each_protection_trips(change: dict[str, float], system: dict[str, float], trip: int) -> None:
    bench = Bench(SYSTEM.replace(**system))
    bench.march(0.8, **change)
    assert bench.now["trip"] == trip
    assert abs(bench.now["torque"]) < 1.0


def test_a_step_of_torque_has_the_bandwidth() -> None:
    bench = Bench(dt=1e-3, torque=0.9 * TORQUE)
    rows = bench.march(0.01, torque=TORQUE)
    left = 10.0 * (1.0 - column(rows, "stator_q") / (TORQUE / 11160.0))
    assert np.allclose(left, np.exp(-2.0 * np.pi * 100.0 * 1e-3 * np.arange(1, 11)), atol=1e-6)


def test_a_step_of_frequency_is_followed_by_the_loop() -> None:
    bench = Bench()
    rows = bench.march(0.5, frequency=50.5)
    assert np.abs(column(rows, "grid_angle")).max() > 1e-3
    assert bench.now["grid_angle"] == pytest.approx(0.0, abs=1e-6)
    assert bench.now["lock_hold"] == pytest.approx(2.0 * np.pi * 0.5, rel=1e-4)


# limits ---------------------------------------------------------------------------------------------


def test_a_low_link_weakens_the_field_and_keeps_the_torque() -> None:
    weak = SYSTEM.replace(forced=True).replace(**{"dc_link.voltage": 11000.0})
    bench = Bench(weak)
    bench.march(0.1)
    assert bench.now["stator_d"] > 100.0  # generator convention: against the magnets
    assert bench.now["stator_voltage"] == pytest.approx(0.97 * 11000.0 / math.sqrt(3.0), rel=1e-3)
    assert bench.now["torque"] == pytest.approx(TORQUE, rel=1e-6)
    m = weak.machine
    for most in (6300.0, 5000.0, 3000.0, 100.0):
        i = complex(*reference(TORQUE, 60.0, most, bench.system))
        assert abs(i) <= 2750.0 * (1.0 + 1e-12)
        needed = abs(60j * m.flux - (m.resistance + 60j * m.inductance) * i)
        assert needed <= 0.97 * most * (1.0 + 1e-9) or abs(i) == pytest.approx(2750.0)


def test_current_limits_and_their_priority() -> None:
    bench = Bench()
    bench.march(0.2, torque=2.0 * TORQUE)
    # both limits of the machine's side are reached, with the largest torque that they leave
    assert np.hypot(bench.now["stator_d"], bench.now["stator_q"]) == pytest.approx(2750.0, rel=1e-3)
    assert 1.05 * TORQUE < bench.now["torque"] < 11160.0 * 2750.0
    q = np.linspace(-2750.0, 2750.0, 2001)
    i = np.sqrt(2750.0**2 - q**2) + 1j * q
    inside = np.abs(60j * 93.0 - (0.04425 + 60j * 0.02749) * i) <= 0.97 * bench.now["dc_link_voltage"] / np.sqrt(3.0)
    assert bench.now["stator_q"] == pytest.approx(q[inside].max(), abs=6.0)
    bench = Bench()
    bench.march(0.3, reactive=30e6)
    assert np.hypot(bench.now["grid_d"], bench.now["grid_q"]) == pytest.approx(2970.0, rel=1e-3)
    assert bench.now["grid_power"] == pytest.approx(Bench().now["grid_power"], rel=1e-2)  # active power comes first
    assert 5e6 < bench.now["reactive_power"] < 15e6


# numerics -------------------------------------------------------------------------------------------


def test_substeps_converge_with_first_order() -> None:
    """Energy of the DC link and angle of the grid, in the middle of a swing."""
    ends = []
    for n in (1, 2, 4, 64):
        system = SYSTEM.replace(**{"control.substep": 4e-4 / n * (1.0 + 1e-9)})
        bench = Bench(system, dt=4e-3)
        bench.march(0.02, torque=0.7 * TORQUE, voltage=0.95, frequency=50.3)
        ends.append(bench.x[[ElectricState.index("dc_energy"), ElectricState.index("grid_angle")]])
    errors = np.abs(np.array(ends[:-1]) - ends[-1]) / np.abs(ends[-1])
    assert (errors[0] < [2e-3, 5e-2]).all()
    order = np.log2(errors[:-1] / errors[1:])
    assert (order > 0.85).all()


def test_short_steps_tend_to_the_rates() -> None:
    bench = Bench(dt=1e-5)
    bench.march(1e-3, torque=0.9 * TORQUE, voltage=0.95, reactive=1e6, frequency=50.2)
    begin = bench.x.copy()
    rates, now = bench.rates(), bench.x.copy()
    found = [(bench.advanced(begin, dt) - begin[:N_STATES]) / dt for dt in (2e-6, 1e-6)]
    errors = [np.abs(each - rates) for each in found]
    large = errors[0] > 1e-4 * np.abs(rates)
    assert large.sum() > 5
    assert np.allclose(errors[0][large] / errors[1][large], 2.0, atol=0.1)
    limit = 2.0 * found[1] - found[0]
    assert np.allclose(limit, rates, rtol=1e-3, atol=1.0)
    recorded = slice(ElectricState.index("torque"), ElectricState.index("stored_power"))
    assert np.allclose(now[recorded], begin[recorded], rtol=0.02, atol=1.0)


def slowest(system: ElectricalSystem, torque: float, voltage: float) -> float:
    """Largest amplification of a sub-step, over all that it can do to small changes of the states."""
    h = system.control.longest_step * (1.0 - 1e-9)
    bench = Bench(system, dt=h, torque=torque)
    bench.inputs[3] = voltage
    electric_begin(h, *bench.inputs, bench.system)
    begin, columns = bench.x.copy(), []
    for j in range(N_STATES):
        change = np.zeros_like(begin)
        change[j] = 1e-6 * max(abs(begin[j]), 0.01 if ElectricState.names[j] in ("grid_angle", "lock_hold") else 1.0)
        up, down = (bench.advanced(begin + sign * change, h) for sign in (1.0, -1.0))
        columns.append((up - down) / (2.0 * change[j]))
    return float(np.abs(np.linalg.eigvals(np.array(columns))).max())


@pytest.mark.parametrize("current", [50.0, 300.0, 2000.0])
def test_loops_that_are_accepted_are_stable(current: float) -> None:
    """With the longest sub-step, and the fastest control of the DC link, that the record takes."""
    accepted = []
    for share, turn in ((0.1, 0.49), (0.33, 0.49), (0.33, 0.1), (0.1, 0.05), (0.33, 0.03)):
        loop = share * current
        control = {"current_bandwidth": current, "voltage_bandwidth": loop, "lock_bandwidth": loop}
        try:
            system = SYSTEM.replace(
                control={**control, "substep": min(turn / (2.0 * math.pi * loop), 0.01)}, **{"dc_link.chopper": None}
            )
        except meltemi.InputError as error:
            assert "is too much for the energy of the filter" in str(error)
            continue
        accepted.append(max(slowest(system, x * TORQUE, u) for x, u in ((1.0, 1.0), (0.05, 1.0), (1.0, 0.91))))
    assert len(accepted) > 0
    assert max(accepted) < 1.0


def test_a_step_that_is_accepted_follows_the_chopper() -> None:
    """The link under the chopper alone falls from step to step, and does not swing about where it begins to act."""
    link = SYSTEM.dc_link
    assert link.chopper is not None
    most = (
        link.chopper.resistance
        * link.capacitance
        / (link.chopper.full / (link.chopper.full - link.chopper.begin) + 2.0)
    )
    SYSTEM.replace(**{"control.substep": 0.99 * most})
    with pytest.raises(meltemi.InputError, match="faster than sub-steps"):
        SYSTEM.replace(**{"control.substep": 1.01 * most})
    e = Bench().system
    volts = np.linspace(1.0, 1.2, 400) * link.voltage
    energy = 0.5 * link.capacitance * volts**2
    after = energy - 0.99 * most * np.array([dissipated(v, e) for v in volts])
    assert (np.diff(after) >= -1e-9 * energy[0]).all()


def test_axes_turn_with_the_phase_locked_loop() -> None:
    """Current in its axes, and its control, see the speed of the loop itself, with its proportional part."""
    bench, f = Bench(), SYSTEM.filter
    bench.march(0.02, frequency=50.3, voltage=0.95)
    bench.rates()
    x, r = bench.now, bench.slope
    w, rate = 2.0 * math.pi * 50.3 - float(r["grid_angle"]), 2.0 * math.pi * 100.0
    assert abs(w - 2.0 * math.pi * 50.0 - float(x["lock_hold"])) > 0.1
    i, held = complex(*x["grid"]), complex(*x["grid_hold"])
    inner = (f.resistance - rate * f.inductance + 1j * w * f.inductance) * i
    y = complex(*r["grid_hold"]) / rate + inner + held
    assert abs(y) == pytest.approx(float(x["converter_voltage"]), rel=1e-12)
    source = 0.95 * SYSTEM.grid_peak * cmath.exp(1j * float(x["grid_angle"]))
    expected = (y - source - (f.resistance + 1j * w * f.inductance) * i) / f.inductance
    assert complex(*r["grid"]) == pytest.approx(expected, rel=1e-9)
