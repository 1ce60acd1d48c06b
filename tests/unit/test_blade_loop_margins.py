"""Margins of blade loops on the test bench: closed forms, multiblade coordinates, verdicts, names."""

import math
from dataclasses import replace

import numpy as np
import pytest

import meltemi
from meltemi.tuning.controller_bench.bench import _margin_verdicts
from meltemi.tuning.controller_bench.margins import STEP, OpenLoop, Whirl, blade_loop, moment_amplitude
from meltemi.tuning.controller_bench.study import one_name
from meltemi.tuning.controller_bench.suite import BenchLimits
from meltemi.tuning.controller_bench.tables import margin_rows
from meltemi.tuning.controller_bench.verdicts import LoopMargins


def test_margins_of_a_loop_on_amplitudes_of_blades():
    """L = k exp(-i (phi + w T)) / (i w), w of either sign: both sides count, and the pole between them does not.

    The phase margin is that of the side on which phi lags, pi/2 - phi - k T; L = -1 at w = (pi/2 - phi) / T.
    """
    k, lag, T = 0.8, math.radians(20.0), 0.3
    side = np.geomspace(0.05, 20.0, 2000)
    w = np.concatenate([-side[::-1], side])
    for phi in (lag, -lag):  # the mirrored loop has the same margins
        loop = OpenLoop(12.0, w, k * np.exp(-1j * (phi + w * T)) / (1j * w), 0.0)
        assert loop.phase_margin == pytest.approx(math.pi / 2.0 - lag - k * T, rel=1e-4)
        assert loop.gain_margin == pytest.approx((math.pi / 2.0 - lag) / (k * T), rel=1e-4)
        assert loop.crossover == pytest.approx(k, rel=1e-4)
        threefold = OpenLoop(12.0, w, 3.0 * loop.response, 0.0)
        assert threefold.gain_margin == pytest.approx(loop.gain_margin / 3.0, rel=1e-4)
        assert replace(loop, response=0.5 * loop.response).sensitivity < loop.sensitivity


def test_loop_of_the_blades_is_recovered_from_their_moments():
    """M = D S(w) with S = L / (1 + L) on moments of blades that turn; their mean and tilt at rest fall out.

    Moments arrive a step late, at the azimuth of the call; a rotor that is not isotropic answers at -w, too.
    """
    whirl, k, late, speed, scale = Whirl(period=20.0, settling=10.0), 0.8 * np.exp(0.3j), 0.02, 1.3, 2.0e6
    time = STEP * np.arange(round(whirl.duration / STEP) + 1)
    w, n = 2.0 * math.pi * whirl.lines, round(whirl.period / STEP)
    d = np.fft.fft([whirl.amplitude(t) for t in time[:n]])
    at = np.round(whirl.lines * whirl.period).astype(int)
    assert not set(at) & set(-at)
    L = k / (1j * w)
    spectrum = np.zeros_like(d)
    spectrum[at] = -d[at] * L / (1.0 + L)
    spectrum[-at] += 0.3 * np.conj(spectrum[at])
    seen = np.resize(np.fft.ifft(spectrum), len(time))  # at the calls
    psi = speed * time

    def blades(sign):
        early = np.fft.fft(sign * seen[:n])
        early *= np.exp(2j * math.pi * np.fft.fftfreq(n, STEP) * late)
        M = np.resize(np.fft.ifft(early), len(time)) * np.exp(1j * speed * late) + 0.1 - 0.2j
        return [scale * (3.0 + (M * np.exp(1j * (psi + 2.0 * math.pi * b / 3.0))).real) for b in range(3)]

    up, down = (moment_amplitude(blades(s), psi % (2.0 * math.pi), scale, late) for s in (1.0, -1.0))
    loop = blade_loop(12.0, whirl, up, down, delay=late)
    assert np.abs(loop.response / L - 1.0).max() < 1e-9
    assert loop.repeatability < 1e-9


def blade_loop_of(gain, repeatability=0.01):
    """k exp(-i w T) / (i w) with T = 0.1 s: phase margin pi/2 - k T, gain margin pi / (2 k T)."""
    side = np.geomspace(0.05, 60.0, 400)
    w = np.concatenate([-side[::-1], side])
    return OpenLoop(12.0, w, gain * np.exp(-0.1j * w) / (1j * w), repeatability)


def test_a_tenfold_gain_fails_the_margins_of_the_blade_loops():
    limits = BenchLimits()
    phase, gain = _margin_verdicts("blade loops", [blade_loop_of(0.8)], limits)
    assert (phase.criterion, gain.criterion) == ("blade loops: phase margin", "blade loops: gain margin")
    assert phase.passed and phase.value == pytest.approx(90.0 - math.degrees(0.08), rel=1e-3)
    assert gain.passed and gain.value == pytest.approx(20.0 * math.log10(math.pi / 0.16), rel=1e-3)
    tenfold = list(_margin_verdicts("blade loops", [blade_loop_of(8.0)], limits))
    assert tenfold[1].passed is False and tenfold[1].value == pytest.approx(gain.value - 20.0, rel=1e-3)
    oscillates = list(_margin_verdicts("blade loops", [blade_loop_of(0.8), blade_loop_of(8.0, 2.0)], limits))
    assert all(v.passed is False and "no linear response at 12 m/s" in v.where for v in oscillates)
    (nothing, _) = _margin_verdicts("blade loops", [blade_loop_of(0.8, 2.0)], limits)
    assert nothing.passed is False and math.isnan(nothing.value)
    assert list(_margin_verdicts("blade loops", (), limits)) == []
    speed = list(_margin_verdicts("speed loop", [blade_loop_of(0.8, 2.0)], limits))
    assert [v.passed for v in speed] == [None] * 3 and speed[2].criterion == "speed loop: delay margin"


def test_margins_of_both_loops_are_named():
    head, rows = margin_rows({"ipc": [blade_loop_of(0.8)], "baseline": []}, {"ipc": [blade_loop_of(0.8)]})
    assert head[:3] == ["controller", "loop", "wind m/s"]
    assert [row[1] for row in rows] == ["speed loop", "blade loops"]
    assert rows[1][head.index("delay margin s")] == "-"
    assert LoopMargins.of([blade_loop_of(0.8, 2.0)]).nonlinear == (12.0,)


def test_one_controller_has_one_name():
    """``cpc`` adds nothing to the baseline where the pitch actuator is ideal, else a notch filter."""
    turbine = meltemi.load_turbine("nrel5mw")
    assert one_name(["cpc", "ipc", "baseline", "CPC"], turbine) == ["baseline", "ipc"]
    assert one_name(["ipc", "ipc"], turbine) == ["ipc", "ipc"]  # refused later, in words
    slow = turbine.replace(
        **{
            "pitch_actuator.kind": "second_order",
            "pitch_actuator.natural_frequency": 11.1,
            "pitch_actuator.damping_ratio": 0.6,
        }
    )
    assert one_name(["cpc", "baseline"], slow) == ["cpc", "baseline"]
