"""``tune_ipc`` on a turbine: its plants are those of the machine in time, and its gains follow the margins."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import meltemi
from meltemi import Controller, InputError, Model, Result, SteadyWind
from meltemi.analysis import LinearModel, LoopTuning, tune_ipc
from meltemi.control import signals as s
from meltemi.controllers import tuning
from meltemi.controllers.names import SCHEMES
from meltemi.controllers.tuning import (
    default_speeds,
    gain_reserve,
    linear_models,
    margins,
    scaled,
    speed_notch,
    tune_loops,
)
from meltemi.simulation.rotors import default_step
from meltemi.turbine import with_flaps

pytestmark = pytest.mark.slow

Complex = NDArray[np.complex128]
WIND = 18.0
SETTLING, JUDGED = 60.0, 120.0
"""[s] before and of the part that is demodulated."""
TONES = (0.0, 0.25, -0.4)
"""[rad/s] by which the amplitudes go around."""
AMPLITUDE = {"pitch": math.radians(0.1), "flap": math.radians(0.5)}
"""[rad] of each tone; all are there at once."""


@pytest.fixture(scope="module")
def machine(turbine: meltemi.Turbine) -> Model:
    """With flaps, and a pitch actuator that has dynamics."""
    return meltemi.build(with_flaps(turbine.replace(**{"pitch_actuator.kind": "second_order"})))


@pytest.fixture(scope="module")
def linear(machine: Model) -> list[LinearModel]:
    return linear_models(machine, [WIND])


def shaken(machine: Model, actuator: str, sign: float, law: Controller | None = None) -> Result:
    """A run in steady wind in which pitch or flap demands have tones about 1P and 2P, beside a law, the collective."""
    law = law or meltemi.control.BaselineController(machine.turbine)
    place = s.PITCH_DEMAND if actuator == "pitch" else s.FLAP_DEMAND
    size = sign * AMPLITUDE[actuator]

    def update(state: Any, measured: Any, demands: Any, dt: float) -> None:
        law.update(state, measured, demands, dt)
        t = measured[s.TIME]
        for blade in range(3):
            psi = measured[s.AZIMUTH] + 2.0 * math.pi * blade / 3.0
            tones = sum(math.cos(n * psi + w * t) for n in (1, 2) for w in TONES)
            demands[place + blade] = (demands[place + blade] if actuator == "pitch" else 0.0) + size * tones

    return meltemi.simulate(
        machine,
        SteadyWind(speed=WIND),
        duration=SETTLING + JUDGED,
        controller=Controller(update, init=law.init),
        channels=["azimuth", "RootMyc1", "RootMyc2", "RootMyc3"],
    ).raise_for_status()


def amplitude(result: Result, harmonic: int, w: float) -> complex:
    """[N m] of the tone in the blades' moments at ``harmonic`` P, whose amplitude goes around with ``w``."""
    part = result.between(SETTLING, SETTLING + JUDGED)
    M: Complex = np.zeros(len(part.time), complex)
    for blade in range(3):
        psi = part["azimuth"] + 2.0 * math.pi * blade / 3.0
        M += 2.0 / 3.0 * part[f"RootMyc{blade + 1}"] * np.exp(-1j * harmonic * psi)
    window = np.hanning(len(M))
    return complex((window * M * np.exp(-1j * w * part.time)).sum() / window.sum())


@pytest.mark.long
@pytest.mark.parametrize("actuator", ["pitch", "flap"])
def test_plants_are_those_of_the_machine_in_time(machine: Model, linear: list[LinearModel], actuator: Any) -> None:
    up, down = (shaken(machine, actuator, sign) for sign in (1.0, -1.0))
    half_step = 0.5 * float(up.meta["time_step"])  # for which a demand is held
    speed = linear[0].point.rotor_speed
    for harmonic in (1, 2):
        (point,) = tune_ipc(machine, harmonic, actuator, linear=linear, filter_damping=1.0).points
        for w in TONES:
            P = point.plant
            if w != 0.0:
                parts = (
                    np.interp(w, point.frequency, x) for x in (point.plant_response.real, point.plant_response.imag)
                )
                P = complex(*parts)
            expected = P * np.exp(-1j * (harmonic * speed + w) * half_step)
            found = (amplitude(up, harmonic, w) - amplitude(down, harmonic, w)) / (2.0 * AMPLITUDE[actuator])
            assert abs(found) == pytest.approx(abs(expected), rel=0.03), (harmonic, w)
            assert abs(np.angle(found / expected)) < math.radians(2.5), (harmonic, w)
            # with the other sign of the frequency it would not agree
            if w != 0.0:
                wrong = complex(
                    *(np.interp(-w, point.frequency, x) for x in (point.plant_response.real, point.plant_response.imag))
                )
                assert abs(found - wrong) > 3.0 * abs(found - expected)


@pytest.mark.long
def test_loops_act_on_their_own_harmonic_and_on_others_as_computed(machine: Model, linear: list[LinearModel]) -> None:
    # tones of the pitch with a 2P loop of the flaps closed: at 2P it is the loop's own L, at 1P what it does beside
    loop = scaled(tune_ipc(machine, 2, "flap", linear=linear).loop, 0.7)
    closed = meltemi.control.LoadController(machine.turbine, meltemi.control.LoadControl(loops=(loop,)))
    runs = [(shaken(machine, "pitch", sign), shaken(machine, "pitch", sign, closed)) for sign in (1.0, -1.0)]
    dt = float(runs[0][0].meta["time_step"])
    for harmonic in (1, 2):
        (plant,) = tuning._plants(linear, harmonic, [2], dt)
        L = plant.loop(loop, None)
        for w in TONES:
            if w == 0.0 and harmonic == 2:
                continue  # the integrator leaves nothing
            open_loop, with_loop = (
                amplitude(runs[0][i], harmonic, w) - amplitude(runs[1][i], harmonic, w) for i in (0, 1)
            )
            expected = 1.0 / (1.0 + complex(np.interp(w, plant.w, L.real), np.interp(w, plant.w, L.imag)))
            found = with_loop / open_loop
            assert abs(found - expected) < 0.03, (harmonic, w)
            assert abs(1.0 - expected) > 0.1  # it does something


def test_loops_together_keep_the_margins(machine: Model, linear: list[LinearModel]) -> None:
    together = tune_loops(machine, [("pitch", 1), ("flap", 2)], linear=linear)
    for found in together:
        loop = found.loop
        lead_time = loop.proportional_gain / loop.integral_gain
        alone = tune_ipc(machine, loop.harmonic, loop.actuator, linear=linear, lead_time=lead_time).loop
        assert 0.1 < found.factor < 1.0
        assert loop.integral_gain == pytest.approx(found.factor * alone.integral_gain)
        assert loop.offset == alone.offset
        for point in found.points:
            assert point.phase_margin >= math.radians(60.0) and point.gain_margin >= 2.0
            assert not np.allclose(point.together, point.loop)
    alone = tune_ipc(machine, linear=linear)
    assert tune_loops(machine, [("pitch", 1)], linear=linear)[0].loop == alone.loop
    assert tune_loops(machine, []) == ()
    narrow = tune_loops(machine, [("pitch", 1)], linear=linear, filter_damping=0.5)[0].loop
    assert narrow.filter_damping == 0.5 and narrow.integral_gain < alone.loop.integral_gain


@pytest.mark.long
def test_all_schemes_keep_the_margins_at_all_frequencies(
    machine: Model, linear: list[LinearModel], monkeypatch: pytest.MonkeyPatch
) -> None:
    dt = default_step(machine)
    wanted = {scheme.loops for scheme in SCHEMES.values() if scheme.loops}
    tuned = {loops: tune_loops(machine, loops, linear=linear) for loops in wanted}
    # judged between the frequencies of the tuning, and up to half the sampling rate
    monkeypatch.setattr(tuning, "PER_SIDE", 300)
    monkeypatch.setattr(tuning, "ABOUT", np.tan(np.linspace(-1.5, 1.5, 41)))
    for loops, found in tuned.items():
        phase, gain = margins(linear, [each.loop for each in found], sample_time=dt)
        assert phase >= math.radians(60.0) and gain >= 2.0, loops
    (plant,) = tuning._plants(linear, 1, [1], dt)
    assert np.abs(plant.w + plant.speed).max() > 0.99 * math.pi / dt


def test_the_edgewise_mode_limits_the_proportional_part(machine: Model, linear: list[LinearModel]) -> None:
    dt = default_step(machine)
    loop = tune_ipc(machine, linear=linear).loop
    whole = loop.replace(proportional_gain=loop.integral_gain / (loop.filter_damping * linear[0].point.rotor_speed))
    assert 0.0 < loop.proportional_gain < whole.proportional_gain
    assert margins(linear, [whole], sample_time=dt)[1] < 2.0 <= margins(linear, [loop], sample_time=dt)[1]
    (plant,) = tuning._plants(linear, 1, [1], dt)
    L = plant.loop(whole, None)
    tone = np.abs(plant.w + plant.speed) / (2.0 * math.pi)
    edgewise = (tone > 0.9) & (tone < 1.35)
    least = [gain_reserve(plant.w[at], L[at]) for at in (edgewise, tone <= 0.9, tone >= 1.35)]
    assert least[0] < 2.0 < min(least[1:])
    # of all shares of the whole lead the largest integral gain is taken
    gains = [
        tune_ipc(machine, linear=linear, lead_time=t).loop.integral_gain
        for t in tuning.SHARES * whole.proportional_gain / whole.integral_gain
    ]
    assert loop.integral_gain == pytest.approx(max(gains), rel=1e-12)
    assert max(gains) > 1.05 * max(gains[0], gains[-1])


def test_response_is_that_of_direct_solves(linear: list[LinearModel]) -> None:
    m = linear[0]
    s_values = np.array([0.3j, 2.0j, -1.3j, 0.1 + 5.0j])
    found = m.response(s_values)
    for at, H in zip(s_values, found, strict=True):
        direct = m.C @ np.linalg.solve(at * np.eye(len(m.A)) - m.A, m.B) + m.D
        assert np.abs(H - direct).max() < 1e-7 * np.abs(direct).max()


def test_gains_follow_the_margins(machine: Model, linear: list[LinearModel]) -> None:
    loops: dict[float, LoopTuning] = {
        margin: tune_ipc(machine, 1, linear=linear, phase_margin=math.radians(margin)) for margin in (45.0, 60.0, 75.0)
    }
    gains = [found.loop.integral_gain for found in loops.values()]
    assert gains[0] > gains[1] > gains[2] > 0.0
    for margin, found in loops.items():
        (point,) = found.points
        assert math.radians(margin) <= point.phase_margin < math.radians(margin) + 0.05
        assert point.gain_margin >= 2.0
        # slow changes meet a pure integrator
        middle = int(np.argmin(np.abs(point.frequency - 2e-3)))
        slow = point.loop[middle] * 1j * point.frequency[middle]
        assert slow == pytest.approx(1.0 / found.loop.tracking_time, rel=0.02)
        assert point.bandwidth == pytest.approx(slow.real, rel=0.2)
    usual, tight = (tune_ipc(machine, 2, "flap", linear=linear, gain_margin=margin) for margin in (2.0, 20.0))
    assert usual.points[0].gain_margin < 20.0 <= tight.points[0].gain_margin
    assert abs(tight.loop.integral_gain) < abs(usual.loop.integral_gain)


def test_flaps_get_a_negative_gain(machine: Model, linear: list[LinearModel]) -> None:
    loop = tune_ipc(machine, 2, "flap", linear=linear).loop
    assert loop.integral_gain < 0.0 and loop.actuator == "flap" and loop.harmonic == 2


def test_operating_points_go_from_above_rated_to_cut_out(machine: Model) -> None:
    speeds = default_speeds(machine)
    assert len(speeds) == 4 and speeds[-1] == machine.turbine.cut_out
    assert 11.4 < speeds[0] < 13.5
    assert np.allclose(np.diff(speeds), speeds[1] - speeds[0])


def test_the_notch_lies_at_the_drivetrain(linear: list[LinearModel]) -> None:
    notch = speed_notch(linear[0])
    # of the mode in which all blades bend edgewise against the shaft
    modes = [m for m in linear[0].modes() if m.coordinates[int(np.argmax(np.abs(m.shape)))] == "1st edge collective"]
    assert notch.frequency == pytest.approx(modes[0].frequency, rel=0.01)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"phase_margin": 0.0}, "phase_margin must lie between 0 and pi/2"),
        ({"phase_margin": 1.6}, "phase_margin must lie between 0 and pi/2"),
        ({"gain_margin": 1.0}, "gain_margin must be above 1"),
        ({"harmonic": 3}, "3"),
        ({"actuator": "flap", "flap": 2}, "flap 2 is required, the blades have 1"),
    ],
)
def test_what_cannot_be_tuned_is_refused(
    machine: Model, linear: list[LinearModel], arguments: dict[str, Any], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        tune_ipc(machine, linear=linear, **arguments)
