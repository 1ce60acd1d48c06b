"""What is given wrong is told in words, whatever the function or record."""

from __future__ import annotations

import inspect
import pickle
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from types import FunctionType
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi import InputError, TurbulentWind
from meltemi.core.calls import arguments_of, explained
from meltemi.core.fingerprint import fingerprint
from meltemi.core.units import from_text
from meltemi.namespaces import NAMESPACES, declared

TURBINE = meltemi.load_turbine("pmsg20mw")
MODEL = meltemi.build(TURBINE)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (
            lambda: meltemi.simulate(MODEL, 12.0),
            r"simulate: missing a required (keyword-only )?argument: 'duration'; valid arguments are model",
        ),
        (lambda: meltemi.simulate(MODEL, 12.0, duraton=2.0), "unknown argument 'duraton'; did you mean 'duration'"),
        (lambda: meltemi.simulate(MODEL, "12", duration=2.0), "wind: expected a number or SteadyWind or .*found '12'"),
        (
            lambda: meltemi.simulate("pmsg20mw", 12.0, duration=2.0),
            "model: expected the model from build.*, found str",
        ),
        (lambda: meltemi.simulate(MODEL, 12.0, duration="long"), "duration: expected a number, found 'long'"),
        (
            lambda: meltemi.simulate(MODEL, 12.0, duration=2.0, start=meltemi.Start("str")),  # type: ignore[arg-type]
            "start.rotor_speed: expected a number or 'idling', found 'str'",
        ),
        (lambda: meltemi.build("nrel5mw"), "build: turbine: expected Turbine or PowerTurbine, found 'nrel5mw'"),  # type: ignore[call-overload]
        (lambda: meltemi.analysis.linearise(MODEL, 12.0), "linearise: point: expected OperatingPoint, found 12.0"),  # type: ignore[arg-type]
        (
            lambda: meltemi.plot(meltemi.simulate(MODEL, 9.0, duration=0.5), "rotor"),
            "plot: channels: expected a list of texts or None, found 'rotor'",
        ),
        (lambda: meltemi.load_turbine(3), "load_turbine: name: expected a text or Path, found 3"),
        (lambda: meltemi.load_turbine("a" * 300), "a: File name too long|no turbine 'a+' in the library"),
        (lambda: TurbulentWind(12.0, 0.14), r"fields are given by name: TurbulentWind\(speed=12.0, intensity=0.14\)"),
        (lambda: TurbulentWind(speed=12.0, intensity=14), "TurbulentWind: intensity: expected less than 2, found 14$"),
        (lambda: TurbulentWind.model_validate({"speed": 12.0}), "TurbulentWind: intensity: missing"),
        (lambda: meltemi.Environment(air_density=float("nan")), "air_density: expected a finite number, found nan$"),
        (lambda: setattr(meltemi.SteadyWind(speed=3.0), "speed", 4.0), r"frozen .*replace\(speed=...\)"),
        (lambda: TURBINE.replace(**{"electrical.machine.rated_power": 5e-324}), "too small or too large to compute"),
        (lambda: meltemi.turbine.size_electrical(5e-324, 100.0), "rated_power must lie between"),
        (lambda: meltemi.ModelOptions(corrections=1), "unknown key; did you mean 'advanced.corrections'?"),  # type: ignore[call-arg]
        (lambda: meltemi.ModelOptions().replace(corrections=1), "has no 'corrections': did you mean 'advanced.corr"),
        (lambda: meltemi.ModelOptions(stall_constants={"a2": 1e9}), "stall_constants.a2: expected less than"),  # type: ignore[arg-type]
        (lambda: meltemi.ModelOptions(stall_constants={"a1": 0.9, "a2": 0.9}), "at most 1, found 1.8"),  # type: ignore[arg-type]
    ],
)
def test_what_is_given_wrong_is_told_in_words(call: Callable[[], Any], said: str) -> None:
    with pytest.raises(InputError, match=said) as caught:
        call()
    assert "pydantic" not in str(caught.value)


class Wrong:
    """No function takes it."""


LAZY = {"ConstantController", "find_rosco", "naca64618_flap", "air_density", "list_climates", "list_turbines"}
"""Functions that need nothing."""


@pytest.mark.parametrize("namespace", ["meltemi", *(f"meltemi.{name}" for name in NAMESPACES)])
def test_every_function_names_an_argument_of_the_wrong_kind(namespace: str) -> None:
    home = import_module(namespace)
    for name in {*declared(namespace)} - LAZY:
        function = getattr(home, name)
        if not isinstance(function, FunctionType):
            continue
        asked = [p for p in inspect.signature(function).parameters.values() if p.default is p.empty]
        unnamed = [Wrong() for p in asked if p.kind is p.POSITIONAL_OR_KEYWORD]
        if unnamed:
            with pytest.raises(InputError, match="expected|needs|must be|unknown|valid are"):
                function(*unnamed, **{p.name: Wrong() for p in asked if p.kind is p.KEYWORD_ONLY})


def test_errors_of_the_user_s_own_code_stay_what_they_are() -> None:
    def reduce(result: meltemi.Result) -> None:
        raise TypeError("mine")

    outcome = meltemi.simulate_batch([meltemi.Run(MODEL, 9.0, duration=1.0)], reduce=reduce)[0]
    assert outcome.error is TypeError


def test_a_number_is_steady_wind() -> None:
    bare = meltemi.simulate(MODEL, 9.0, duration=1.0)
    wind = meltemi.simulate(MODEL, meltemi.SteadyWind(speed=9.0), duration=1.0)
    assert np.array_equal(bare.data, wind.data)
    assert pickle.loads(pickle.dumps(meltemi.simulate)) is meltemi.simulate


def test_an_event_may_last_longer_than_any_run() -> None:
    event = {"at": 0.5, "type": "grid_loss", "until": 1e40}
    assert meltemi.simulate(MODEL, 9.0, duration=1.0, events=[event]).status is meltemi.Status.OK


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("8 deg", "rad", np.radians(8.0)),
        ("0.1 rad", "rad", 0.1),
        ("12 rpm", "rad/s", 12.0 * np.pi / 30.0),
        ("-2 deg/s", "rad/s", -np.radians(2.0)),
        (["1 deg", 0.5], "rad", [np.radians(1.0), 0.5]),
        ("8 deg", "rad/s", "8 deg"),
        ("8 dge", "rad", "8 dge"),
        ("8", "rad", "8"),
        (0.1, "rad", 0.1),
    ],
)
def test_texts_with_a_unit(text: Any, unit: str, value: Any) -> None:
    assert from_text(text, unit) == value if isinstance(value, str) else from_text(text, unit) == pytest.approx(value)


def test_every_record_takes_angles_with_a_unit() -> None:
    turbine = meltemi.load_turbine("nrel5mw")
    twist = [f"{np.degrees(x)} deg" for x in turbine.blade.aerodynamics.twist]
    changed = turbine.replace(**{"hub.precone": "2.5 deg", "blade.aerodynamics.twist": twist, "yaw.rate": "0.3 deg/s"})
    assert changed.hub.precone == pytest.approx(np.radians(2.5))
    assert changed.yaw.rate == pytest.approx(np.radians(0.3))
    np.testing.assert_allclose(changed.blade.aerodynamics.twist, turbine.blade.aerodynamics.twist, rtol=1e-12)
    with pytest.raises(InputError, match=r"precone: expected less than 0.6, found 2.5 rad; 0.6 rad is 34.4 deg"):
        turbine.replace(**{"hub.precone": 2.5})
    with pytest.raises(InputError, match=r"precone: expected less than 0.6, found '2.5' rad; .* 2.5 deg would be"):
        turbine.replace(**{"hub.precone": "2.5"})
    with pytest.raises(InputError, match="found '8 dge'; a number is in rad, another unit is written behind it: 8 deg"):
        TurbulentWind(speed=9.0, intensity=0.1, direction="8 dge")  # type: ignore[arg-type]


def test_fingerprints_tell_code_and_content_apart() -> None:
    def gain(k: float) -> Callable[[float], float]:
        return lambda x: k * x

    assert fingerprint(gain(1.0), np.ones(3)) == fingerprint(gain(1.0), np.ones(3)) is not None
    assert fingerprint(gain(1.0)) != fingerprint(gain(2.0))
    assert fingerprint(lambda x: x) != fingerprint(lambda x: x + 1)
    assert fingerprint(partial(gain, 1.0)) != fingerprint(partial(gain, 2.0))
    assert fingerprint({"a": 1.0}) != fingerprint({"a": 2.0})
    assert fingerprint(object()) is None


@dataclass(frozen=True, kw_only=True)
class How:
    """How it is done.

    Attributes:
      workers: threads.
    """

    workers: int = 1


@dataclass(frozen=True)
class What(How):
    """What is done.

    Attributes:
      name: of it.
    """

    name: str


def test_arguments_of_a_record_that_derives_from_another() -> None:
    @arguments_of(What)
    def do(asked: What) -> str:
        """Do it."""
        return f"{asked.name} by {asked.workers}"

    assert do("wash", workers=2) == "wash by 2"
    assert [*inspect.signature(do).parameters] == ["name", "workers"]
    assert do.__doc__ is not None and "name: of it." in do.__doc__ and "workers: threads." in do.__doc__
    with pytest.raises(InputError, match="unknown argument 'worker'; did you mean 'workers'"):
        explained(do)("wash", worker=2)  # type: ignore[call-arg]
