"""Preview: the law on vectors, the wind that it is given, and what it does for the turbine."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import InputError, Model, Result, SteadyWind, Turbine, WindBox, simulate
from meltemi.analysis import preview_of, steady_pitch
from meltemi.control import LoadControl, LoadController, Preview
from meltemi.control import signals as s
from meltemi.control_laws.filters import LowPass, low_pass
from meltemi.control_laws.load_control import LoadControlState
from meltemi.control_laws.lookup import linear
from meltemi.control_laws.preview import PreviewState, preview_change, preview_settings
from meltemi.maths.vectors import Vec
from meltemi.studies.preview import FREQUENCY, rotor_average
from meltemi.wind.fields import wind_field
from meltemi.wind.velocity import wind_velocity

Float = NDArray[np.float64]
WIND, PITCH = (10.0, 12.0, 18.0, 14.0, 14.0), (0.0, 0.0, 0.1, 0.3)
GIVEN: dict[str, Any] = {
    "wind": WIND,
    "time_step": 2.0,
    "lead": 1.0,
    "frequency": 0.8,
    "first_speed": 10.0,
    "spacing": 2.0,
    "pitch": PITCH,
}
DT = 0.01


def table(speed: float) -> float:
    return float(np.interp(speed, 10.0 + 2.0 * np.arange(len(PITCH)), PITCH))


# the law ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("place", "value"),
    [(-1.0, 3.0), (0.0, 3.0), (0.25, 4.0), (1.0, 7.0), (1.5, 6.0), (2.0, 5.0), (2.1, 5.0), (1e9, 5.0)],
)
def test_series_are_linear_between_values_and_held_at_their_ends(place: float, value: float) -> None:
    x = np.array([3.0, 7.0, 5.0, 99.0])
    assert linear(x, 3, place) == pytest.approx(value)


def test_the_wind_to_come_is_low_passed_and_read_from_the_table() -> None:
    """By hand: the series ahead by the lead, the filter, the table; and from any place of a vector."""
    x = preview_settings(**GIVEN)
    assert len(x.array) == len(PreviewState) + len(WIND) + len(PITCH)
    longer = PreviewState(np.concatenate([np.full(7, np.nan), x.array])[7:])
    state = LowPass.of(integrator=11.0)
    pitch = table(11.0)
    for k in range(1200):
        speed = low_pass(state, float(np.interp(DT * k + 1.0, 2.0 * np.arange(5), WIND)), 0.8, DT)
        change = preview_change(x, DT * k, DT)
        assert preview_change(longer, DT * k, DT) == change
        pitch += change
        assert pitch == pytest.approx(table(speed), abs=1e-12)


def test_changes_add_up_to_that_of_the_steady_pitch() -> None:
    """Through a gust and long after it: from the pitch of the first wind to that of the last."""
    x = preview_settings(**GIVEN)
    changes = np.array([preview_change(x, DT * k, DT) for k in range(4000)])
    assert changes.sum() == pytest.approx(table(WIND[-1]) - table(11.0), abs=1e-9)
    assert np.cumsum(changes).max() > 1.3 * table(WIND[-1])
    assert np.all(changes[-500:] == pytest.approx(0.0, abs=1e-9))


def test_the_filter_delays_by_its_time_constant() -> None:
    """On a ramp of wind and a straight table the pitch is that of the wind a lead later, a time constant before."""
    ramp = preview_settings(
        np.arange(10.0, 30.0), 1.0, lead=3.0, frequency=0.8, first_speed=0.0, spacing=40.0, pitch=(0.0, 1.0)
    )
    start = 13.0 / 40.0
    total = start + sum(preview_change(ramp, DT * k, DT) for k in range(1001))
    assert 40.0 * total == pytest.approx(10.0 + 10.0 + 3.0 - 1.0 / 0.8, abs=0.01)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"wind": (12.0,)}, "wind must be a row of at least two"),
        ({"wind": (12.0, np.nan)}, "wind must be .* finite"),
        ({"wind": ((12.0, 13.0), (12.0, 13.0))}, "wind must be a row"),
        ({"pitch": (0.1,)}, "pitch must be a row of at least two"),
        ({"pitch": (0.1, np.inf)}, "pitch must be .* finite"),
        ({"time_step": 0.0}, "time_step must be a positive number, found 0.0"),
        ({"frequency": -1.0}, "frequency must be a positive number"),
        ({"spacing": np.nan}, "spacing must be a positive number"),
        ({"lead": -0.1}, "lead must be zero or a positive time"),
        ({"lead": np.inf}, "lead must be zero or a positive time"),
    ],
)
def test_numbers_that_cannot_be_are_refused(turbine: Turbine, change: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=f"preview: {words}"):
        preview_settings(**{**GIVEN, **change})
    with pytest.raises(InputError):
        LoadController(turbine, LoadControl(preview=Preview(**{**GIVEN, **change})))


def test_the_integral_moves_the_pitch_by_the_change(turbine: Turbine) -> None:
    """At reference speed nothing but preview acts: the collective pitch settles on the steady pitch of the wind."""
    reference = turbine.control.pitch.reference_speed
    settings = Preview(
        **{**GIVEN, "wind": (12.0, 12.0, 16.0, 16.0, 14.0, 14.0), "lead": 0.0, "pitch": (0.0, 0.1, 0.2, 0.3)}
    )
    controller = LoadController(turbine, LoadControl(preview=settings))
    x = controller.initial_state(meltemi.control.StartPoint(12.0, reference, 0.1, 4e4))
    measured, demands = s.Measurements.zeros(), s.Demands.zeros()
    measured[s.GENERATOR_SPEED], measured[s.N_BLADES] = reference, 3
    found = []
    for k in range(3000):
        measured[s.TIME] = DT * k
        controller.update(x, measured, demands, DT)
        found.append(LoadControlState(x).collective.pitch)
    assert max(found) == pytest.approx(0.3, abs=0.03)  # the filter has not quite got there
    assert found[-1] == pytest.approx(0.2, abs=1e-3)
    assert np.all(demands[s.PITCH_DEMAND : s.PITCH_DEMAND + 3] == found[-1])


# what it is given ---------------------------------------------------------------------------------------------


def box(velocity: Any, **changes: Any) -> WindBox:
    settings: dict[str, Any] = {"dt": 0.25, "dy": 15.0, "dz": 15.0, "bottom": 15.0, "speed": 18.0}
    return WindBox(velocity=velocity, **{**settings, **changes})


def gust(seconds: float = 60.0, periodic: bool = False) -> WindBox:
    """18 m/s everywhere, with 5 m/s more for 4 s in the middle."""
    t = 0.25 * np.arange(round(seconds / 0.25) + 1)
    u = 18.0 + 2.5 * (1.0 - np.cos(0.5 * np.pi * (t - 28.0))) * (np.abs(t - 30.0) < 2.0)
    velocity = np.zeros((len(t), 11, 11, 3))
    velocity[..., 0] = u[:, None, None]
    return box(velocity, periodic=periodic)


def test_the_average_is_that_of_the_points_inside_the_rotor() -> None:
    rng = np.random.default_rng(5)
    field = box(rng.normal(12.0, 2.0, (6, 11, 10, 3)))
    found = rotor_average(field, hub_height=87.0, radius=63.0)
    for k, value in enumerate(found):
        inside = [
            float(field.velocity[k, i, j, 0])
            for i in range(11)
            for j in range(10)
            if np.hypot(15.0 + 15.0 * i - 87.0, 15.0 * j - 67.5) <= 63.0
        ]
        assert 40 < len(inside) < 70
        assert value == pytest.approx(np.mean(inside), rel=1e-6)
    with pytest.raises(InputError, match="no point of the wind's grid lies inside the rotor"):
        rotor_average(field, hub_height=300.0, radius=63.0)


@pytest.mark.parametrize("periodic", [False, True])
def test_planes_pass_the_rotor_when_preview_says_so(model: Model, periodic: bool) -> None:
    """The series of the preview is the wind at the rotor's centre, an overhang upwind of the tower."""
    wind = gust(periodic=periodic)
    preview = preview_of(model, wind, (4.0, np.zeros(20)))
    kernel_wind = wind_field(wind, 90.0, 126.0)
    times = 0.05 * np.arange(1001)
    said = np.interp(times, preview.time_step * np.arange(len(preview.wind)), preview.wind)

    def at(x: float) -> Float:
        return np.array([wind_velocity(Vec(x, 0.0, 90.0), t, kernel_wind).x for t in times.tolist()])

    assert said.max() > 22.5
    assert np.abs(at(-model.turbine.nacelle.overhang) - said).max() < 0.1
    assert np.abs(at(0.0) - said).max() > 0.5


def test_the_lead_is_the_delay_of_filter_and_actuator(turbine: Turbine) -> None:
    steady = (4.0, np.zeros(20))
    ideal, second = (
        meltemi.build(turbine.replace(**{"pitch_actuator.kind": kind})) for kind in ("ideal", "second_order")
    )
    assert preview_of(ideal, gust(), steady).lead == pytest.approx(1.0 / FREQUENCY)
    assert preview_of(ideal, gust(), steady, frequency=0.5).lead == pytest.approx(2.0)
    actuator = turbine.pitch_actuator
    delay = 2.0 * actuator.damping_ratio / actuator.natural_frequency
    assert preview_of(second, gust(), steady, frequency=0.5).lead == pytest.approx(2.0 + delay)


@pytest.mark.parametrize("wind", [SteadyWind(speed=18.0), meltemi.TurbulentWind(speed=18.0, intensity=0.1)])
def test_a_wind_that_is_no_box_is_refused(model: Model, wind: Any) -> None:
    with pytest.raises(InputError, match=f"preview: expected a wind box, found {type(wind).__name__}"):
        preview_of(model, wind)


@pytest.fixture(scope="module")
def steady(model: Model) -> tuple[float, Float]:
    return steady_pitch(model)


@pytest.mark.long
def test_steady_pitch_is_that_of_operating_points(model: Model, steady: tuple[float, Float]) -> None:
    first, pitch = steady
    assert first == model.turbine.cut_in
    speeds = first + np.arange(len(pitch))
    assert speeds[-1] >= model.turbine.cut_out + 9.0
    assert np.all(pitch[speeds < 11.0] == model.turbine.control.pitch.minimum)
    assert np.all(np.diff(pitch[speeds > 11.0]) > 0.0)
    k = int(np.argmin(np.abs(speeds - 19.0)))
    assert pitch[k] == pytest.approx(meltemi.operating_point(model, float(speeds[k])).pitch, abs=1e-9)


# on the machine -----------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def field(turbine: Turbine) -> WindBox:
    return meltemi.wind.generate_field(meltemi.TurbulentWind(speed=20.0, intensity=0.15, seed=3), turbine, 150.0)


def run(model: Model, wind: WindBox, preview: Preview | None, seconds: float = 150.0) -> Result:
    controller = LoadController(model.turbine, LoadControl(preview=preview))
    return simulate(
        model, wind, duration=seconds, channels=["rotor_speed", "TwrBsMyt", "pitch_1"], controller=controller
    ).raise_for_status()


@pytest.mark.long
def test_preview_holds_the_speed_and_spares_the_tower(
    model: Model, field: WindBox, steady: tuple[float, Float]
) -> None:
    """Found in turbulence of 20 m/s: rotor speed std -77 %, tower base equivalent load -31 %."""
    previews = (preview_of(model, field, steady), None)
    with_it, without = (run(model, field, preview).between(30.0, 150.0) for preview in previews)
    assert with_it["rotor_speed"].std() < 0.4 * without["rotor_speed"].std()
    loads = [meltemi.loads.damage_equivalent_load(r["TwrBsMyt"], duration=120.0, slope=4.0) for r in (with_it, without)]
    assert loads[0] < 0.9 * loads[1]


def test_without_preview_no_bit_changes(model: Model, field: WindBox) -> None:
    """Nor with the preview of a wind that stays as it is."""
    still = Preview(**{**GIVEN, "wind": (20.0, 20.0)})
    found = [run(model, field, preview, 20.0).data for preview in (None, still)]
    plain = simulate(model, field, duration=20.0, channels=["rotor_speed", "TwrBsMyt", "pitch_1"])
    for data in found:
        assert np.array_equal(data, plain.data)
