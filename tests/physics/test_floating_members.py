"""Members of floating platforms: buoyancy, inertia, drag; the platforms that have them; operators."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import meltemi
from meltemi.core.errors import InputError
from meltemi.floating.balance import check_balance, lines_load, turbine_weight
from meltemi.floating.coefficients import read_coefficients
from meltemi.floating.members import PIECE, Member, at_rest, flow_at, pieces, with_members

G = 9.80665


def spar(**kwargs: Any) -> list[Member]:
    """The hull of OC3-Hywind."""
    low = {f"plate_{name}": kwargs[name] for name in ("added_mass", "pressure") if name in kwargs}
    return [
        Member(start=[0, 0, -120], end=[0, 0, -12], diameter=9.4, **kwargs, **low),
        Member(start=[0, 0, -12], end=[0, 0, -4], diameter=9.4, end_diameter=6.5, **kwargs),
        Member(start=[0, 0, -4], end=[0, 0, 10], diameter=6.5, **kwargs),
    ]


def test_the_spar_displaces_what_its_report_says() -> None:
    """Jonkman (2010), NREL/TP-500-47535: 8029 m^3 with its centre at -62.07 m, -4.99918e9 N m/rad, 332.94e3 N/m."""
    volume, centre, stiffness = at_rest(spar())
    assert volume == pytest.approx(8029.21, rel=1e-5)
    assert centre == pytest.approx([0.0, 0.0, -62.07], abs=0.01)
    assert 1025.0 * G * stiffness[2, 2] == pytest.approx(332.94e3, rel=2e-3)
    assert 1025.0 * G * stiffness[4, 4] == pytest.approx(-4.99918e9, rel=2e-3)


def test_stiffness_follows_from_the_buoyancy_of_a_displaced_body() -> None:
    """Derivatives of the closed-form buoyancy of four columns that heave and pitch together."""
    columns = [Member(start=[x, y, -20], end=[x, y, 15], diameter=12) for x in (-25, 30) for y in (-25, 25)]
    volume, centre, C = at_rest(columns)
    A = math.pi * 36.0
    assert volume == pytest.approx(4 * 20.0 * A)
    assert C[2, 2] == pytest.approx(4 * A)
    assert C[2, 4] == pytest.approx(-A * 10.0) and C[3, 4] == pytest.approx(0.0, abs=1e-9)
    own = 0.25 * math.pi * 6.0**4
    assert C[4, 4] == pytest.approx(2 * A * (625.0 + 900.0) + 4 * own + volume * centre[2])
    assert C[4, 4] - volume * centre[2] > 0.0


def test_inertia_of_a_vertical_cylinder_is_that_of_the_closed_form() -> None:
    """Force over density, gravity and amplitude in deep water: C_M pi R^2 (1 - exp(-k d)), 90 deg ahead of the wave.

    Pieces of length L have it by the midpoint rule, less (k L)^2 / 24."""
    column = [Member(start=[0, 0, -50], end=[0, 0, 20], diameter=8, added_mass=0.9, pressure=1.0)]
    c = with_members(None, column, 2000.0, G)
    head = int(np.argmin(np.abs(c.heading)))
    for w in (0.4, 0.8, 1.2):
        i = int(np.argmin(np.abs(c.frequency - w)))
        k = c.frequency[i] ** 2 / G
        exact = 1.9 * math.pi * 16.0 * (1.0 - math.exp(-50.0 * k)) * (1.0 - (k * PIECE) ** 2 / 24.0)
        assert c.excitation[i, head, 0] == pytest.approx(1j * exact, rel=1e-4)
    added = 0.9 * math.pi * 16.0 * 50.0
    assert c.infinite[0, 0] == pytest.approx(added) and c.infinite[0, 4] == pytest.approx(-25.0 * added)
    assert c.infinite[2, 2] == 0.0 and not c.damping.any()


def test_the_spar_of_members_is_pushed_as_that_of_potential_flow() -> None:
    """Within 6 % and 6 deg up to 0.8 rad/s, where the hull is slender."""
    panels = read_coefficients("nrel5mw-spar")
    members = with_members(None, spar(added_mass=1.0, pressure=1.0), 320.0, G)
    scale = np.array([1.0, 1.0, 1.0, 60.0, 60.0, 60.0])
    some = members.infinite / np.outer(scale, scale), panels.infinite / np.outer(scale, scale)
    assert some[0] == pytest.approx(some[1], abs=0.04 * float(some[1].max()))
    assert members.hydrostatic == pytest.approx(panels.hydrostatic, rel=1e-5, abs=1e-2)
    head = int(np.argmin(np.abs(members.heading)))
    for w in (0.3, 0.5, 0.8):
        i, j = (int(np.argmin(np.abs(c.frequency - w))) for c in (panels, members))
        for k in (0, 2, 4):
            ratio = members.excitation[j, head, k] / panels.excitation[i, head, k]
            assert abs(ratio) == pytest.approx(1.0, abs=0.06) and abs(np.angle(ratio, deg=True)) < 6.0


def test_flow_at_the_pieces_is_that_of_linear_waves() -> None:
    sea = meltemi.environment.RegularSea(height=2.0, period=10.0)
    place = np.array([[0.0, 0.0, -5.0], [30.0, 10.0, -20.0]])
    flow = flow_at(place, sea, 200.0, 30.0, (0.0, 0.0), G)
    w = 2.0 * math.pi / 10.0
    k = w * w / G
    for n, (_, _, z) in enumerate(place):
        u, v, up = flow[:, 3 * n : 3 * n + 3].T
        size = w * math.exp(k * z)
        assert np.hypot(u, up) == pytest.approx(np.full(len(u), size), rel=2e-3)
        assert not v.any()
    current = meltemi.environment.Current(uniform=0.7, direction=0.0)
    moved = flow_at(place, sea.replace(current=current), 200.0, 30.0, (0.0, 0.0), G) - flow
    assert moved == pytest.approx(np.tile([0.7, 0.0, 0.0], (len(flow), 2)))


def test_pieces_converge_and_every_coefficient_counts() -> None:
    p = pieces(spar(drag=0.6))
    assert p.drag.sum() == pytest.approx(0.3 * (9.4 * 108.0 + 7.95 * 8.0 + 6.5 * 4.0))
    assert p.volume.sum() == pytest.approx(8029.21, rel=1e-5) and not p.added.any()
    base = Member(start=[0, 0, -20], end=[0, 0, 5], diameter=10)
    for name in ("drag", "added_mass", "pressure", "plate_drag", "plate_added_mass", "plate_pressure"):
        changed = pieces([base.replace(**{name: 1.0})])
        assert any(np.abs(getattr(changed, f) - getattr(pieces([base]), f)).max() > 0.0 for f in vars(changed))


def test_members_that_do_not_fit_are_refused() -> None:
    platform = meltemi.load_turbine("nrel5mw-spar").platform
    assert platform is not None
    with pytest.raises(InputError, match=r"members displace 8029.2 m\^3 of water, and volume is 9000"):
        platform.replace(coefficients="", volume=9000.0)
    with pytest.raises(InputError, match="same point"):
        platform.replace(members=[{"start": [0, 0, -1], "end": [0, 0, -1], "diameter": 2.0}])


@pytest.mark.parametrize("name", ["nrel5mw-spar", "iea15mw-volturnus"])
def test_platforms_that_do_not_float_are_refused(name: str) -> None:
    turbine = meltemi.load_turbine(name)
    platform = turbine.platform
    assert platform is not None
    c = read_coefficients(platform.coefficients)
    check_balance(turbine, c)
    line = platform.lines[0]
    for change, words in (
        ({"mass": 2.0 * platform.mass}, "platform sinks"),
        ({"volume": 1.5 * platform.volume}, "platform rises"),
        ({"centre": platform.centre + np.array([0.0, 0.0, 80.0])}, "platform capsizes in roll"),
        ({"volume": 1e-3 * platform.volume}, "reference length of 1 m"),
        ({"lines": (line.replace(length=400.0), *platform.lines[1:])}, "further apart than its length of 400 m"),
        ({"lines": (line.replace(diameter=2.0), *platform.lines[1:])}, "line 1 floats"),
    ):
        with pytest.raises(InputError, match=words):
            check_balance(turbine.replace(platform=platform.replace(**change)), c)


def test_the_spar_is_in_balance() -> None:
    """Weight of the OC3 system and pull of its lines equal its buoyancy: less than 1 mm of heave."""
    turbine = meltemi.load_turbine("nrel5mw-spar")
    platform = turbine.platform
    assert platform is not None
    mass, moment = turbine_weight(turbine)
    assert mass == pytest.approx(599718.0, abs=1.0) and moment / mass == pytest.approx(70.31, abs=0.01)
    lift = 1025.0 * platform.volume - platform.mass - mass + lines_load(platform, np.zeros(6))[2] / G
    assert abs(lift) < 1e-3 * 1025.0 * read_coefficients("nrel5mw-spar").hydrostatic[2, 2]


def test_the_mass_at_the_tower_top_weighs_on_the_platform() -> None:
    turbine = meltemi.load_turbine("nrel5mw-spar")
    mass, moment = turbine_weight(turbine)
    top = turbine.tower.base_height + turbine.tower.length
    more = turbine_weight(turbine.replace(**{"tower.top_mass": 5e4}))
    assert more == pytest.approx((mass + 5e4, moment + 5e4 * top), rel=1e-12)


@pytest.mark.slow
def test_the_spar_has_the_periods_of_its_report() -> None:
    """Jonkman & Musial (2010), OC3 phase IV: surge 0.0080, heave 0.0324, pitch 0.0342, yaw 0.121 Hz."""
    turbine = meltemi.load_turbine("nrel5mw-spar")
    modes = {
        mode.name: mode.frequency / (2.0 * math.pi) for mode in meltemi.analysis.natural_modes(meltemi.build(turbine))
    }
    for name, known, share in (
        ("surge", 0.0080, 0.01),
        ("heave", 0.0324, 0.015),
        ("pitch", 0.0342, 0.025),
        ("yaw", 0.121, 0.015),
    ):
        assert modes[f"base {name}"] == pytest.approx(known, rel=share)


@pytest.mark.slow
def test_drag_of_a_current_is_the_sum_over_the_hull() -> None:
    """A current of 1 m/s pushes the platform at rest with half rho C_d times the area of the hull under water."""
    base = tuple(f"base {name}" for name in ("surge", "sway", "heave", "roll", "pitch", "yaw"))
    model = meltemi.build(meltemi.load_turbine("nrel5mw-spar"), meltemi.ModelOptions(locked=base))
    sea = meltemi.environment.RegularSea(height=0.001, period=10.0, current={"uniform": 1.0})
    start = meltemi.Start(pitch=0.5 * math.pi, coordinates={})
    force = []
    for some in (None, sea):
        result = meltemi.simulate(
            model, 0.01, duration=0.2, controller=meltemi.control.ConstantController(), start=start, sea=some,
            channels=["water_force_x", "platform_surge"],
        )  # fmt: skip
        force.append(result["water_force_x"][0])
    area = 9.4 * 108.0 + 7.95 * 8.0 + 6.5 * 4.0
    assert force[1] - force[0] == pytest.approx(0.5 * 1025.0 * 0.6 * area, rel=0.02)


@pytest.mark.long
def test_operators_of_the_linear_model_are_those_of_a_run() -> None:
    from meltemi.floating.rao import linear_operators, random_operators

    model = meltemi.build(meltemi.load_turbine("iea15mw-volturnus"))
    linear = linear_operators(model)
    run, coherence = random_operators(model, duration=1800.0)
    for name in ("platform_surge", "platform_heave", "platform_pitch"):
        k = linear.channels.index(name)
        some = (run.frequency > 0.3) & (run.frequency < 1.5) & (coherence[:, k] > 0.9)
        there = [
            np.interp(run.frequency[some], linear.frequency, part)
            for part in (linear.value[:, k].real, linear.value[:, k].imag)
        ]
        ratio = run.value[some, k] / (there[0] + 1j * there[1])
        assert some.sum() > 20
        assert np.median(np.abs(ratio)) == pytest.approx(1.0, abs=0.01)
        assert abs(np.median(np.angle(ratio, deg=True))) < 2.0
    with pytest.raises(InputError, match="does not float"):
        linear_operators(meltemi.build(meltemi.load_turbine("nrel5mw")))


@pytest.mark.long
def test_the_spar_of_members_moves_as_that_of_potential_flow() -> None:
    """Standard deviations within 2 %, correlation above 0.998; without drag it surges 10 % more."""
    turbine = meltemi.load_turbine("nrel5mw-spar")
    platform = turbine.platform
    assert platform is not None
    without = tuple(member.replace(drag=0.0) for member in platform.members)
    changes: dict[str, Any] = {
        "panels": {},
        "members": {"coefficients": "", "members": tuple(spar(drag=0.6, added_mass=1.0, pressure=1.0))},
        "no drag": {"members": without},
    }
    found = {}
    for name, change in changes.items():
        result = meltemi.simulate(
            meltemi.build(turbine.replace(platform=platform.replace(**change))),
            0.01,
            duration=600.0,
            controller=meltemi.control.ConstantController(),
            start=meltemi.Start(pitch=0.5 * math.pi),
            sea=meltemi.environment.IrregularSea(height=6.0, period=10.0, seed=3),
            channels=["platform_surge", "platform_heave", "platform_pitch"],
            output_step=0.2,
        )
        found[name] = result.data[500:]
    for k in range(3):
        panels, members = found["panels"][:, k], found["members"][:, k]
        assert members.std() == pytest.approx(panels.std(), rel=0.02)
        assert np.corrcoef(panels, members)[0, 1] > 0.998
    assert found["no drag"][:, 0].std() > 1.05 * found["panels"][:, 0].std()
