"""One number at a time in a wrong unit is refused or told, or stands below with the reason why it cannot be known."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Literal

import pytest
from wrong_units import changed, silent_tries

import meltemi
from meltemi import Environment, InputError, SteadyWind
from meltemi.cases.case import LoadCase
from meltemi.core.record import Record
from meltemi.core.usual import UsualRange, unusual_numbers, usual_range
from meltemi.farm.settings import WakeSettings
from meltemi.floating.members import Member
from meltemi.loads.loadbase.campaign import Campaign
from meltemi.loads.loadbase.metocean import FOLDER, read_metocean
from meltemi.loads.surrogate.campaign import SurrogateCampaign
from meltemi.sea.crest import Crest
from meltemi.sea.current import Current
from meltemi.sea.irregular import IrregularSea
from meltemi.sea.regular import RegularSea
from meltemi.sea.spreading import Spreading
from meltemi.turbine import plausibility_warnings
from meltemi.turbine.definition import Hub
from meltemi.wind.fields import unusual
from meltemi.wind.turbulent import TurbulentWind

ANY = "any value of this magnitude may be meant"
SPREAD = "real machines differ by more than this factor"
PLACE = "any place on the pile or the members is allowed"
FREE = "stands for whatever the user wants to add"
UNTOLD = {
    # turbines
    "BladeAerodynamics.centre_x": SPREAD,  # with or without the prebend
    "DampingTime.torsion": SPREAD,
    "Drivetrain.generator_inertia": SPREAD,
    "Drivetrain.stiffness": SPREAD,
    "Drivetrain.damping": SPREAD,
    "TorqueControl.rate_limit": SPREAD,
    "PlanetaryStage.carrier_inertia": SPREAD,
    "PlanetaryStage.planet_inertia": SPREAD,
    "PlanetaryStage.sun_inertia": SPREAD,
    "Shaft.friction": SPREAD,
    "HeierCoefficient.constants": FREE,  # of a formula
    "Support.stations": PLACE,
    "PointMass.height": PLACE,
    "PointMass.length": SPREAD,
    "Member.start": PLACE,
    "Member.end": PLACE,
    "Member.diameter": PLACE,  # of a brace
    "Member.end_diameter": PLACE,  # of a cone
    "Platform.centre": "a platform that capsizes by it is refused when the model is built",
    "Platform.stiffness": FREE,
    # seas, winds, cases, campaigns: zero is usual for angles, and so is what is near it
    "Current.direction": ANY,
    "IrregularSea.direction": ANY,
    "RegularSea.direction": ANY,
    "RegularSea.phase": ANY,
    "Crest.time": ANY,
    "IrregularSea.height": "seas of 0.1 m occur",
    "RegularSea.height": "waves of 0.1 m occur",
    "IrregularSea.seed": ANY,
    "TurbulentWind.seed": ANY,
    "WakeSettings.seed": ANY,
    "Campaign.realisation": ANY,
    "SurrogateCampaign.realisation": ANY,
    "SurrogateCampaign.points": ANY,
    "SurrogateCampaign.checks": ANY,
    "SteadyWind.direction": ANY,
    "SteadyWind.upflow": ANY,
    "SteadyWind.veer": ANY,
    "SteadyWind.shear_exponent": ANY,
    "SteadyWind.roughness": "roughness is from 1e-5 m of ice to 3 m of a town",
    "TurbulentWind.direction": ANY,
    "TurbulentWind.upflow": ANY,
    "TurbulentWind.shear_exponent": ANY,
    "Supervision.start_time": SPREAD,
    "Supervision.restart_time": SPREAD,
    "Supervision.power_time": SPREAD,
    "Supervision.brake": "a share of 0 to 1",
    "Campaign.begin": ANY,
    "LoadCase.duration": ANY,
    "LoadCase.transient": ANY,
    "StallConstants.a1": FREE,
    "StallConstants.a2": FREE,
    "StallConstants.b1": FREE,
    "StallConstants.b2": FREE,
    "AdvancedOptions.induction_tolerance": ANY,
    **{f"VortexOptions.{name}": ANY for name in ("free", "shed")},
    **{f"VortexOptions.{name}": SPREAD for name in ("blade_core", "wake_core", "eddy_viscosity")},
    "PowerGrid.voltage": "a dip",
}
"""Fields of which some factor is neither refused nor told. A foot in place of a metre, a factor of 3, is within what
machines differ by, unless the length has a relation to others: those are in ``LENGTHS``."""
LENGTHS = (
    "BladeAerodynamics.position BladeAerodynamics.chord BladeStructure.position Hub.radius Nacelle.overhang "
    "Nacelle.shaft_height Tower.position Tower.diameter Support.position Support.diameter "
    "Support.thickness Platform.depth MooringLine.length MooringLine.diameter MooringLine.anchor"
).split()
MOST = 0.1
"""Share of silent tries of a turbine."""
TURBINES = ["iea15mw-monopile", "iea15mw-volturnus", "iea22mw-semi", "nrel5mw-monopile", "nrel5mw-spar", "zr20-122"]


def check_silent(record: Record, say: Callable[[Any], Iterable[str]]) -> float:
    """Check that what is silent has a reason; returns its share."""
    assert not [*say(record)]
    tries, silent = silent_tries(record, say)
    assert not [each for each in silent if each[0] in LENGTHS]
    assert not {field for field, factor in silent if factor != "0.3048"} - set(UNTOLD)
    return len(silent) / tries


def test_a_turbine_in_wrong_units() -> None:
    assert check_silent(meltemi.load_turbine("nrel5mw"), plausibility_warnings) < MOST


@pytest.mark.long
@pytest.mark.parametrize("name", TURBINES)
def test_other_turbines_in_wrong_units(name: str) -> None:
    if name.startswith("iea"):
        pytest.importorskip("windIO")
    assert check_silent(meltemi.load_turbine(name), plausibility_warnings) < MOST


@pytest.mark.parametrize("name", ["pmsg20mw", "pmsg20mw-bem"])
def test_a_power_turbine_in_wrong_units(name: Literal["pmsg20mw", "pmsg20mw-bem"]) -> None:
    assert check_silent(meltemi.load_turbine(name), plausibility_warnings) < MOST


def of_sea(sea: Any) -> list[str]:
    """What a run in 50 m of water refuses or tells."""
    sea.components(50.0, 100.0)
    return [str(words) for words in sea.doubts()]


def of_wind(wind: Any) -> list[str]:
    """What a run tells of its wind."""
    return [*unusual_numbers(wind), *unusual(wind)]


WIND = {"speed": 12.0, "direction": 0.2, "upflow": 0.1}
CREST, CURRENT = Crest(height=9.0), Current(sub_surface=1.0, near_surface=0.3, uniform=0.2, direction=0.4)
OTHERS: list[tuple[Record, Callable[[Any], Iterable[str]]]] = [
    (IrregularSea(height=6.0, period=12.0, direction=0.5, level=1.0, crest=CREST, current=CURRENT), of_sea),
    (IrregularSea(height=6.0, period=12.0, spreading=Spreading(exponent=2.0, width=3.0)), of_sea),
    (RegularSea(height=6.0, period=10.0, direction=0.5, phase=0.4), of_sea),
    (Environment(air_density=1.2, gravity=9.81), unusual_numbers),
    (SteadyWind(**WIND, shear_exponent=0.2, veer=0.001, reference_height=90.0), of_wind),
    (SteadyWind(speed=12.0, roughness=0.03), of_wind),
    (TurbulentWind(**WIND, intensity=0.16, dt=0.05, length_factor=1.5), of_wind),
    (WakeSettings(intensity=0.1, step=2.0, ceiling=300.0, cut_off=10.0), unusual_numbers),
    (SurrogateCampaign(turbine="nrel5mw", duration=500.0, transient=50.0), unusual_numbers),
    (LoadCase(turbine="nrel5mw", wind={"kind": "steady", "speed": 12.0}, duration=600.0, transient=60.0), of_wind),
    (
        Campaign(
            turbine="nrel5mw",
            wind_class="IB",
            cut_in=3.0,
            rated_wind=11.4,
            cut_out=25.0,
            rotor_speed=1.267,
            hub_height=90.0,
            rotor_diameter=126.0,
            idle_pitch=1.57,
            normal_rate=0.07,
            emergency_rate=0.14,
            duration=600.0,
            transient=60.0,
            begin=60.0,
            yaw_error=8.0,
            v_maint=15.0,
            years=25.0,
        ),
        unusual_numbers,
    ),
    (read_metocean(FOLDER / "iea22.yaml"), unusual_numbers),
]


@pytest.mark.parametrize(("record", "say"), OTHERS, ids=lambda value: type(value).__name__)
def test_other_records_in_wrong_units(record: Record, say: Callable[[Any], Iterable[str]]) -> None:
    check_silent(record, say)


@pytest.mark.long
def test_no_reason_is_left_over() -> None:
    pytest.importorskip("windIO")
    tried = [(meltemi.load_turbine(name), plausibility_warnings) for name in ("nrel5mw", "pmsg20mw", *TURBINES)]
    silent = [each for record, say in [*tried, *OTHERS] for each in silent_tries(record, say)[1]]
    assert {field for field, factor in silent if factor != "0.3048"} == set(UNTOLD)


@pytest.mark.parametrize(
    ("name", "keys", "factor", "words"),
    [
        ("nrel5mw-monopile", "support.diameter", 1e3, "support.diameter: 6000 m is unusual; usual is 2.3 to 15 m"),
        ("nrel5mw-monopile", "support.elastic_modulus", 1e-3, "support.elastic_modulus: 2.1e+08 N/m^2 is unusual"),
        ("nrel5mw-monopile", "support.density", 1e-3, "support.density: 8.5 kg/m^3 is unusual"),
        ("nrel5mw", "nacelle.overhang", 1.0 / 0.3048, "nacelle.overhang: 16.47 m is unusual"),
        ("nrel5mw", "drivetrain.generator_efficiency", 1e-3, "drivetrain.generator_efficiency: 0.000944"),
        ("nrel5mw", "control.pitch.proportional_gain", 100.0, "control.pitch.proportional_gain: it times reference"),
        ("nrel5mw", "tower.drag_coefficient", 100.0, "tower.drag_coefficient: 100 is unusual; usual is 0.35 to 1.5"),
        ("nrel5mw", "cut_out", 3.6, "cut_out: 90 m/s is unusual; usual is 12 to 40 m/s"),
        ("nrel5mw-spar", "platform.inertia", 1e-3, "platform.inertia: largest radius of gyration"),
    ],
)
def test_the_message_has_key_value_and_range(name: str, keys: str, factor: float, words: str) -> None:
    said = plausibility_warnings(changed(meltemi.load_turbine(name), tuple(keys.split(".")), factor))
    assert any(sentence.startswith(words) for sentence in said), said


def test_anchors_ballast_and_members_have_places() -> None:
    turbine = meltemi.load_turbine("nrel5mw-spar")
    platform = turbine.platform
    deep = turbine.replace(**{"platform.depth": 1e3 * platform.depth})
    assert any(".anchor: its height above the sea bed" in words for words in plausibility_warnings(deep))
    low = turbine.replace(**{"platform.centre": [0.0, 0.0, -78e3]})
    assert any(words.startswith("platform.centre: its height [m]") for words in plausibility_warnings(low))
    upside_down = tuple(
        each.replace(start=each.start * (1, 1, -1), end=each.end * (1, 1, -1)) for each in platform.members
    )
    for coefficients in platform.members, upside_down:
        said = plausibility_warnings(turbine.replace(**{"platform.members": tuple(m.content() for m in coefficients)}))
        assert any("platform.members" in words for words in said) == (coefficients is upside_down)
    with pytest.raises(InputError, match="at most 500 m"):
        Member(start=[0.0, 0.0, -120e3], end=[0.0, 0.0, -12e3], diameter=9.4e3)


def test_water_in_a_pile_ends_below_its_top() -> None:
    turbine = meltemi.load_turbine("nrel5mw-monopile")
    with pytest.raises(InputError, match="flooded: 300 m above mean sea level is not in the pile"):
        turbine.replace(**{"support.flooded": 300.0})


def test_steep_and_breaking_seas() -> None:
    with pytest.raises(InputError, match="waves of 9 m break with a period of 3 s"):
        IrregularSea(height=9.0, period=3.0).components(50.0, 100.0)
    with pytest.raises(InputError, match="a crest of 30 m breaks in water of 20 m"):
        IrregularSea(height=6.0, period=12.0, crest=Crest(height=30.0)).components(20.0, 100.0)
    (said,) = IrregularSea(height=9.0, period=8.0).doubts()
    assert said.startswith("sea: height 9 m and period 8 s have a steepness of 0.09")


def test_air_of_a_thousandth_and_durations() -> None:
    (said,) = unusual_numbers(Environment(air_density=0.001225), "environment")
    assert said == "environment.air_density: 0.001225 kg/m^3 is unusual; usual is 0.7 to 1.6 kg/m^3"
    for duration in (0.2, 6e5):
        assert [*unusual_numbers(SurrogateCampaign(turbine="nrel5mw", duration=duration))]


@pytest.mark.parametrize(
    "make",
    [
        lambda a: SteadyWind(speed=9.0, direction=a),
        lambda a: RegularSea(height=1.0, period=9.0, direction=a),
        lambda a: Current(direction=a),
    ],
)
def test_a_direction_of_270_speaks_of_degrees(make: Callable[[float], Record]) -> None:
    with pytest.raises(InputError, match=r"270.* rad; .*and 270 deg would be written so"):
        make(270.0)


def test_ranges_stand_beside_units() -> None:
    assert usual_range(Hub.model_fields["mass"].description) == UsualRange("kg", 2.5e3, 1.2e5, 3)
    assert usual_range("[N m s/rad; 1 to 2 at 100 m] of it.") == UsualRange("N m s/rad", 1.0, 2.0, 4)
    assert usual_range("[kg] of it.") is None and usual_range(None) is None
    hub = meltemi.load_turbine("nrel5mw").hub.replace(mass=56.78e6)
    assert [*unusual_numbers(hub, "hub")] == []  # of what size of rotor?
    (said,) = unusual_numbers(hub, "hub", 126.0)
    assert said == "hub.mass: 5.678e+07 kg is unusual; usual is 5e+03 to 2.4e+05 kg for a rotor of 126 m"


@pytest.mark.parametrize("power", [1e4, 1e5, 1e6, 2.5e7])
def test_scaled_turbines_are_usual(power: float) -> None:
    for name in ("nrel5mw", "ct30-155", "zr20-122"):
        reference = meltemi.load_turbine(name)
        diameter = reference.rotor_diameter * (power / reference.rated_power) ** 0.5
        try:
            made = meltemi.turbine.scale_turbine(reference, rotor_diameter=diameter)
        except InputError:  # its pitch would be faster than 2 rad/s
            continue
        assert plausibility_warnings(made) == ()
