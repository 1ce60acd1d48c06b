"""Electrical system with full-power converters: generator, converters, DC link, filter and grid connection.

Currents, voltages and flux linkages are peak values of a phase in dq axes, amplitude-invariant: powers are 3/2 times
their products. The nominal voltage of the grid alone is the usual line-to-line rms value.

Reference: docs/theory/electrical.md.
"""

from __future__ import annotations

import math
from numbers import Integral, Real
from typing import Any, Self

from pydantic import Field, model_validator

from meltemi.core.errors import InputError
from meltemi.core.record import Record
from meltemi.environment.grid import NOMINAL_FREQUENCY
from meltemi.turbine.checks import ordered

LINE = math.sqrt(1.5)
"""Line-to-line rms over the peak of a phase."""
RESERVE = 0.97
"""Share of the DC link's voltage limit that steady operation may use."""
MOST_COPPER, MOST_FILTER = 0.1, 0.05
"""Largest plausible losses of stator and filter, as a share of rated power."""

MOST_TURN = 0.5
"""[rad] largest phase of a control loop at its natural frequency in one explicit step: half that at which it would be
unstable."""
MOST_SWING = 10.0
"""Largest change of a current when its voltage falls to zero at once, over the rated current."""
LONGEST_STORE = 10.0
"""[s] largest energy of the DC link over rated power."""
FORCE = " (forced: true accepts it)"
"""Remedy in messages on an inconsistent system."""


class PermanentMagnetMachine(Record):
    """Synchronous generator with surface-mounted permanent magnets (L_d = L_q)."""

    rated_power: float = Field(gt=0.0)
    """[W] rated electromagnetic power."""
    rated_speed: float = Field(gt=0.0)
    """[rad/s] rated speed of the shaft."""
    pole_pairs: int = Field(ge=1)
    """Half the number of poles [-; 1 to 300]."""
    flux: float = Field(gt=0.0)
    """[Wb; 0.1 to 300] peak flux linkage of a phase with the magnets."""
    resistance: float = Field(gt=0.0)
    """[Ohm; 1e-4 to 10] resistance of a phase of the stator."""
    inductance: float = Field(gt=0.0)
    """[H; 1e-5 to 0.5] synchronous inductance of a phase."""
    iron_loss: float = Field(default=0.0, ge=0.0)
    """[W] iron and stray losses at rated speed; they grow with its square."""

    @property
    def rated_current(self) -> float:
        """Current [A] at rated power with zero d-axis current."""
        return self.rated_power / (1.5 * self.rated_emf)

    @property
    def rated_emf(self) -> float:
        """Electromotive force [V] at rated speed."""
        return self.rated_frequency * self.flux

    @property
    def rated_frequency(self) -> float:
        """Electrical frequency [rad/s] of the stator at rated speed."""
        return self.pole_pairs * self.rated_speed

    @property
    def rated_voltage(self) -> float:
        """Terminal voltage [V] at rated power with zero d-axis current."""
        i, w = self.rated_current, self.rated_frequency
        return math.hypot(self.rated_emf - self.resistance * i, w * self.inductance * i)

    @property
    def copper_loss(self) -> float:
        """Copper loss [W] at rated power."""
        return 1.5 * self.resistance * self.rated_current**2


class Converter(Record):
    """Averaged converter: current limit, and losses p0 (V_dc/V_nominal)^2 + voltage_drop i + resistance i^2."""

    current: float = Field(gt=0.0)
    """[A] limit of the current's peak value."""
    standing_loss: float = Field(default=0.0, ge=0.0)
    """[W; 300 to 3e4 at 100 m] no-load loss at the nominal voltage of the DC link."""
    voltage_drop: float = Field(default=0.0, ge=0.0)
    """[V; 2 to 300] loss for each ampere of the current's peak value."""
    resistance: float = Field(default=0.0, ge=0.0)
    """[Ohm; 5e-4 to 0.5] loss for the square of the current's peak value."""

    def loss(self, current: float) -> float:
        """Loss [W] at the nominal voltage of the DC link."""
        return self.standing_loss + (self.voltage_drop + self.resistance * current) * current


class Chopper(Record):
    """Pulsed brake resistor in the DC link, averaged: its power increases with the voltage."""

    resistance: float = Field(gt=0.0)
    """[Ohm; 0.02 to 100] resistance."""
    begin: float = Field(default=1.06, gt=1.0, lt=2.0)
    """Voltage at which it starts, per unit of the nominal one."""
    full: float = Field(default=1.12, gt=1.0, lt=2.0)
    """Voltage at which it is fully on, per unit of the nominal one."""
    heat: float = Field(gt=0.0)
    """[J; 1e5 to 1e9] heat capacity; more heat trips the turbine."""
    cooling_time: float = Field(default=120.0, gt=0.0)
    """[s; 10 to 2000] time constant of its cooling."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        ordered(self, "begin", "full")
        return self


class DCLink(Record):
    """Capacitor between the converters."""

    voltage: float = Field(gt=0.0)
    """[V; 300 to 5e4] nominal voltage."""
    capacitance: float = Field(gt=0.0)
    """[F; 1e-4 to 1] capacitance."""
    chopper: Chopper | None = None
    """Chopper; without it, power that the grid cannot absorb trips the turbine."""
    highest: float = Field(default=1.25, gt=1.0, lt=3.0)
    """Voltage above which the turbine trips, per unit of the nominal one."""
    lowest: float = Field(default=0.7, ge=0.1, lt=1.0)
    """Voltage below which the turbine trips, per unit of the nominal one [-; 0.3 to 0.95]."""


class GridFilter(Record):
    """Inductor between converter and grid, with the transformer's leakage."""

    resistance: float = Field(gt=0.0)
    """[Ohm; 1e-5 to 1] resistance of a phase."""
    inductance: float = Field(gt=0.0)
    """[H; 1e-6 to 0.1] inductance of a phase."""


class RideThrough(Record):
    """Fault ride-through requirements of the grid code (E.ON 2006; TransmissionCode 2007)."""

    gain: float = Field(default=2.0, ge=0.0, le=10.0)
    """Reactive current over rated current [-; 0.7 to 6], per voltage deviation from 1."""
    dead_band: float = Field(default=0.1, gt=0.0, lt=1.0)
    """Voltage deviation [-; 0.04 to 0.3] (per unit) beyond which reactive current has priority."""
    zero_time: float = Field(default=0.15, ge=0.0)
    """[s; 0.05 to 1] duration of zero voltage without a trip."""
    recovery_time: float = Field(default=1.5, gt=0.0)
    """[s; 0.5 to 10] time from the dip's begin until the voltage must be in the band; the limit rises linearly."""
    highest_voltage: float = Field(default=1.3, gt=1.0)
    """Voltage above which the turbine trips [-; 1.05 to 2], per unit of the nominal one."""
    lowest_frequency: float = Field(default=47.0, gt=0.0)
    """[Hz; 45 to 60] frequency below which the turbine trips."""
    highest_frequency: float = Field(default=52.0, gt=0.0)
    """[Hz; 50 to 65] frequency above which the turbine trips."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        ordered(self, "zero_time", "recovery_time", "s")
        ordered(self, "lowest_frequency", "highest_frequency", "Hz")
        return self


class ConverterControl(Record):
    """Bandwidths of the converters' control loops."""

    current_bandwidth: float = Field(default=100.0, gt=0.0, le=2000.0)
    """[Hz; 20 to 1000] bandwidth of the current controls of both sides."""
    voltage_bandwidth: float = Field(default=10.0, gt=0.0)
    """[Hz; 1 to 100] natural frequency of the control of the DC link's voltage, by the grid side."""
    lock_bandwidth: float = Field(default=10.0, gt=0.0)
    """[Hz; 1 to 100] natural frequency of the phase-locked loop."""
    substep: float | None = Field(default=None, gt=0.0, le=0.01)
    """[s] longest step of the controls; by default a quarter of the current control's time constant."""

    @model_validator(mode="after")
    def _check(self) -> Self:
        for name in ("voltage_bandwidth", "lock_bandwidth"):
            if getattr(self, name) > 0.34 * self.current_bandwidth:
                raise ValueError(
                    f"{name} {getattr(self, name):g} Hz must be at most a third of current_bandwidth "
                    f"{self.current_bandwidth:g} Hz, which it acts through"
                )
            longest = MOST_TURN / (2.0 * math.pi * getattr(self, name))
            if self.longest_step > longest:
                raise ValueError(
                    f"substep {self.longest_step:g} s is too long for {name} {getattr(self, name):g} Hz, whose loop is "
                    f"followed in explicit steps; at most {longest:.3g} s"
                )
        return self

    @property
    def longest_step(self) -> float:
        """Longest step [s] of the controls."""
        return self.substep or 0.25 / (2.0 * math.pi * self.current_bandwidth)


class ElectricalSystem(Record):
    """Electrical system from the generator shaft to the grid."""

    machine: PermanentMagnetMachine
    machine_converter: Converter
    dc_link: DCLink
    grid_converter: Converter
    filter: GridFilter
    voltage: float = Field(gt=0.0)
    """[V; 200 to 4e4] nominal voltage of the grid, line to line, rms."""
    frequency: float = Field(default=50.0, gt=0.0)
    """[Hz; 49 to 61] nominal frequency of the grid."""
    control: ConverterControl = ConverterControl()
    ride_through: RideThrough = RideThrough()
    forced: bool = False
    """True disables the consistency checks."""
    source: str = ""

    @property
    def grid_peak(self) -> float:
        """Peak phase voltage [V] of the grid at nominal voltage."""
        return self.voltage / LINE

    @property
    def rated_grid_current(self) -> float:
        """Peak grid current [A] at rated power of the machine and nominal voltage."""
        return self.machine.rated_power / (1.5 * self.grid_peak)

    @property
    def limit_voltage(self) -> float:
        """Largest peak phase voltage [V] of the converters at nominal DC link voltage."""
        return self.dc_link.voltage / math.sqrt(3.0)

    def problems(self) -> list[str]:
        """Inconsistencies of the system, as messages; empty if there are none."""
        m, f, problems = self.machine, self.filter, []
        P, limit, i = m.rated_power, RESERVE * self.limit_voltage, self.rated_grid_current
        if m.copper_loss > MOST_COPPER * P:
            problems.append(
                f"machine.resistance {m.resistance:g} Ohm loses {m.copper_loss / 1e6:.3g} MW of {P / 1e6:.3g} MW at "
                f"the rated current of {m.rated_current:.4g} A"
            )
        if m.iron_loss > MOST_COPPER * P:
            problems.append(
                f"machine.iron_loss {m.iron_loss / 1e6:.3g} MW is too high for a rated power of {P / 1e6:.3g} MW"
            )
        lost = 1.5 * f.resistance * i * i
        if lost > MOST_FILTER * P:
            problems.append(
                f"filter.resistance {f.resistance:g} Ohm loses {lost / 1e6:.3g} MW of {P / 1e6:.3g} MW at the rated "
                f"current of {i:.4g} A; is it {1e-3 * f.resistance:g} Ohm?"
            )
        kept = f"with the {100.0 * (1.0 - RESERVE):.0f} % that the control keeps"
        if m.rated_voltage > limit:
            short = m.rated_voltage > self.limit_voltage
            problems.append(
                f"dc_link.voltage {self.dc_link.voltage:g} V "
                f"{'is below' if short else 'leaves the control no reserve over'} the machine's: at rated power and "
                f"speed its terminals have {LINE * m.rated_voltage:.5g} V line to line (rms), which take "
                f"{math.sqrt(3.0) * m.rated_voltage:.5g} V, and at least "
                f"{math.sqrt(3.0) * m.rated_voltage / RESERVE:.5g} V {kept}"
            )
        x = 2.0 * math.pi * self.frequency * f.inductance * i
        e = math.hypot(self.grid_peak + f.resistance * i, x)
        if e > limit:
            problems.append(
                f"dc_link.voltage {self.dc_link.voltage:g} V is too low for the grid: at rated power the converter "
                f"needs {LINE * e:.5g} V line to line (rms), so at least {math.sqrt(3.0) * e / RESERVE:.5g} V "
                f"{kept}"
            )
        for name, rated in (("machine_converter", m.rated_current), ("grid_converter", i)):
            converter: Converter = getattr(self, name)
            if converter.current < rated:
                problems.append(f"{name}.current {converter.current:g} A is less than the rated {rated:.5g} A (peak)")
            if converter.loss(rated) > MOST_COPPER * P:
                problems.append(f"{name} loses {converter.loss(rated) / 1e6:.3g} MW of {P / 1e6:.3g} MW")
        chopper, highest = self.dc_link.chopper, self.dc_link.highest
        if chopper is not None and chopper.full >= highest:
            problems.append(f"dc_link.chopper.full {chopper.full:g} must be less than dc_link.highest {highest:g}")
        band = self.ride_through
        if not band.lowest_frequency < self.frequency < band.highest_frequency:
            problems.append(
                f"frequency {self.frequency:g} Hz is not between ride_through.lowest_frequency "
                f"{band.lowest_frequency:g} Hz and highest_frequency {band.highest_frequency:g} Hz"
            )
        return problems + self._too_fast()

    def _too_fast(self) -> list[str]:
        """Time scales that are too fast for the controls or their sub-steps (E-27, E-28)."""
        problems: list[str] = []
        P, dc, rate = self.machine.rated_power, self.dc_link, 2.0 * math.pi * self.control.current_bandwidth
        h, wv = self.control.longest_step, 2.0 * math.pi * self.control.voltage_bandwidth
        for name, inductance, volts, amperes in (
            ("machine", self.machine.inductance, self.machine.rated_emf, self.machine.rated_current),
            ("filter", self.filter.inductance, self.grid_peak, self.rated_grid_current),
        ):
            swing = volts / (math.e * rate * inductance * amperes)
            if swing > MOST_SWING:
                problems.append(
                    f"{name}.inductance {inductance:g} H is too small for control.current_bandwidth "
                    f"{self.control.current_bandwidth:g} Hz: a loss of voltage would change the current by {swing:.3g} "
                    f"times the rated one; at least {inductance * swing / MOST_SWING:.2g} H"
                )
        store = 0.5 * dc.capacitance * dc.voltage**2 / P
        if not 1.0 / rate <= store <= LONGEST_STORE:
            low, high = (2.0 * P * t / dc.voltage**2 for t in (1.0 / rate, LONGEST_STORE))
            problems.append(
                f"dc_link.capacitance {dc.capacitance:g} F holds rated power for {store:.3g} s, not between the "
                f"{1.0 / rate:.2g} s in which the currents are controlled and {LONGEST_STORE:g} s: {low:.2g} to "
                f"{high:.2g} F"
            )
        # a change of the current takes energy for the filter from the link immediately
        filling = self.filter.inductance * self.rated_grid_current / self.grid_peak * -math.expm1(-rate * h)
        if math.sqrt(2.0) * wv * (h + filling) > 1.0:
            most = 1.0 / (2.0 * math.pi * math.sqrt(2.0) * (h + filling))
            problems.append(
                f"control.voltage_bandwidth {self.control.voltage_bandwidth:g} Hz is too much for the energy of the "
                f"filter at sub-steps of {h:.3g} s; at most {most:.3g} Hz"
            )
        if dc.chopper is not None:
            gain = dc.chopper.full / (dc.chopper.full - dc.chopper.begin) + 2.0
            longest = dc.chopper.resistance * dc.capacitance / gain
            if h > longest:
                problems.append(
                    f"dc_link.chopper.resistance {dc.chopper.resistance:g} Ohm acts on {dc.capacitance:g} F faster "
                    f"than sub-steps of {h:.3g} s can follow; at least {h * gain / dc.capacitance:.3g} Ohm, or "
                    f"control.substep of at most {longest:.2g} s"
                )
        return problems

    def unfit(self, torque: float, speed: float) -> str:
        """Reason why the system does not match a turbine; empty if it does, or if ``forced``.

        Args:
          torque: [N m] rated torque on the generator shaft.
          speed: [rad/s] generator speed at rated operation.
        """
        m = self.machine
        most = 1.5 * m.pole_pairs * m.flux * self.machine_converter.current
        if self.forced:
            return ""
        if torque > most:
            return (
                f"machine_converter.current {self.machine_converter.current:g} A makes {most:.4g} N m, less than the "
                f"rated torque of {torque:.4g} N m (forced: true accepts it)"
            )
        if not 0.8 * m.rated_speed <= speed <= 1.2 * m.rated_speed:
            return (
                f"machine.rated_speed {m.rated_speed:.4g} rad/s does not match the rated speed of {speed:.4g} rad/s of "
                "the generator's shaft (forced: true accepts it)"
            )
        return ""

    @model_validator(mode="after")
    def _check(self) -> Self:
        if not self.forced and (problems := self.problems()):
            raise ValueError("; ".join(problems) + FORCE)
        return self


def nominal_frequency(system: ElectricalSystem | None) -> float:
    """Nominal frequency [Hz] of the grid."""
    return NOMINAL_FREQUENCY if system is None else system.frequency


LEAST, MOST = 1e-6, 1e12
"""Limits of the numbers for sizing a system: beyond, its parts could not be computed."""


def size_electrical(
    rated_power: float,
    rated_speed: float,
    *,
    voltage: float | None = None,
    frequency: float = 50.0,
    pole_pairs: int | None = None,
    resistance: float = 0.02,
    inductance: float = 0.5,
) -> ElectricalSystem:
    """Size an electrical system with typical per-unit values, based on rated power, speed and voltage.

    Args:
      rated_power: [W] power on the generator shaft.
      rated_speed: [rad/s] speed of the generator shaft.
      voltage: [V] line to line, rms, of machine and grid; by default 690 V up to 6 MW, then 3300 V, and 6600 V from
        14 MW on.
      frequency: [Hz] grid frequency.
      pole_pairs: number of pole pairs; by default for a stator frequency close to 10 Hz in a direct drive, 50 Hz in a
        fast generator.
      resistance: stator resistance, per unit.
      inductance: stator inductance, per unit.

    Raises:
      InputError: a value is not positive, or the resulting system is not feasible.
    """
    given: dict[str, Any] = {"rated_power": rated_power, "rated_speed": rated_speed, "frequency": frequency}
    given |= {"resistance": resistance, "inductance": inductance} | ({} if voltage is None else {"voltage": voltage})
    for name, value in given.items():
        if not (isinstance(value, Real) and 0.0 < float(value) < math.inf):
            raise InputError(f"size_electrical: {name} must be positive, found {value!r}")
        if not LEAST <= float(value) <= MOST:
            raise InputError(f"size_electrical: {name} must lie between {LEAST:g} and {MOST:g}, found {value!r}")
    if voltage is None:
        voltage = 690.0 if rated_power <= 6e6 else 3300.0 if rated_power < 14e6 else 6600.0
    if pole_pairs is None:
        hertz = 10.0 if rated_speed < 5.0 else 50.0
        pole_pairs = max(1, round(2.0 * math.pi * hertz / rated_speed))
    pairs: Any = pole_pairs
    if not (isinstance(pairs, Integral) and int(pairs) >= 1):
        raise InputError(f"size_electrical: pole_pairs must be an integer of at least 1, found {pairs!r}")
    peak, stator_frequency = voltage / LINE, int(pairs) * rated_speed
    current = rated_power / (1.5 * peak)
    base = peak / current
    machine = PermanentMagnetMachine(
        rated_power=rated_power,
        rated_speed=rated_speed,
        pole_pairs=int(pairs),
        flux=peak / stator_frequency,
        resistance=resistance * base,
        inductance=inductance * base / stator_frequency,
        iron_loss=0.005 * rated_power,
    )
    try:
        return complete(machine, voltage, frequency)
    except InputError as error:
        arguments = ", ".join(f"{name} {value:g}" for name, value in given.items())
        words = "; ".join(line.partition(": ")[2] for line in str(error).splitlines()).removesuffix(FORCE)
        raise InputError(f"size_electrical: {arguments} define an inconsistent system: {words}") from None


def complete(machine: PermanentMagnetMachine, voltage: float, frequency: float = 50.0) -> ElectricalSystem:
    """Size converters, DC link and filter for a machine.

    Converters carry 1.15 times the rated current (1.2 at the grid) and lose 1 % each at it, the DC link holds the
    rated power's energy of 20 ms, the chopper takes 1.2 times rated power for 2 s, the filter and the
    transformer have 0.3 and 0.004 per unit.

    Args:
      voltage: [V] grid voltage, line to line, rms.
      frequency: [Hz] grid frequency.
    """
    P, peak = machine.rated_power, voltage / LINE
    current = P / (1.5 * peak)
    base = peak / current
    highest = max(machine.rated_voltage, math.hypot(1.1 * peak, 0.3 * peak), peak * 1.3)
    dc = math.sqrt(3.0) * highest / RESERVE * 1.02
    dc = round(dc, -1) if dc > 100.0 else dc
    return ElectricalSystem(
        machine=machine,
        machine_converter=converter(P, machine.rated_current, 1.15),
        grid_converter=converter(P, current, 1.2),
        dc_link=DCLink(
            voltage=dc,
            capacitance=2.0 * 0.02 * P / dc**2,
            chopper=Chopper(resistance=(1.12 * dc) ** 2 / (1.2 * P), heat=2.0 * 1.2 * P),
        ),
        filter=GridFilter(resistance=0.004 * base, inductance=0.3 * base / (2.0 * math.pi * frequency)),
        voltage=voltage,
        frequency=frequency,
        ride_through=RideThrough(lowest_frequency=0.94 * frequency, highest_frequency=1.04 * frequency),
        source="sized by rule (size_electrical)",
    )


def converter(rated_power: float, rated_current: float, margin: float) -> Converter:
    """A converter with 1 % loss at rated current: 10 % constant, 50 % linear in the current, the rest quadratic."""
    return Converter(
        current=margin * rated_current,
        standing_loss=0.001 * rated_power,
        voltage_drop=0.005 * rated_power / rated_current,
        resistance=0.004 * rated_power / rated_current**2,
    )
