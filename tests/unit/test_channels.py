"""The channel catalogue: complete descriptions, unique names, places that exist, names that are found."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import pytest

from meltemi import InputError, Model, ModelOptions, Stations, build
from meltemi.core.units import FIELD
from meltemi.report.plots import MAIN_CHANNELS
from meltemi.report.tables import POWER_CURVE
from meltemi.simulation.bladed.rotor import SIGNALS
from meltemi.simulation.channels import DEFAULT, Channel, ChannelSet, catalogue, every_kind, find, standard
from meltemi.simulation.plan import choose, model_channels
from meltemi.turbine.definition import Turbine

EVERYTHING = catalogue(
    ChannelSet(
        3,
        20,
        2,
        2,
        (
            "1st fore-aft",
            "yaw",
            "generator",
            "drivetrain",
            "blade 1 1st torsion",
        ),
        2,
    )
)
UNITS = {*"s Hz K Pa kg/m^3 rad rad/s rad/s^2 m m/s m/s^2 N N/m W -".split(), "N m", "N m/m"}


@pytest.mark.parametrize(
    "channel", [pytest.param(c, id=c.name) for c in catalogue(ChannelSet(1, 1, 1, 1, ("1st flap",), 1)).values()]
)
def test_a_channel_describes_itself(channel: Channel) -> None:
    assert channel.name
    assert channel.unit in UNITS
    assert channel.frame
    assert channel.sign
    assert len(channel.description) > 5
    assert "{" not in "".join((channel.name, channel.alias, channel.description, channel.frame))
    # one number, one unit for people
    unit, factor = channel.display_unit
    assert factor > 0.0
    assert (unit == channel.unit) is (factor == 1.0)


@pytest.mark.parametrize("channel", [pytest.param(c, id=c.name) for c in catalogue(ChannelSet(1, 1, 1, 1)).values()])
def test_forces_moments_and_motions_have_axes_and_a_positive_direction(channel: Channel) -> None:
    directed = {"rad", "rad/s", "rad/s^2", "m", "m/s", "m/s^2", "N", "N m", "N/m", "N m/m"}
    scalars = {"skew_angle", "node_1_wind_speed_1"}
    if channel.unit in directed and channel.name not in scalars:
        assert channel.frame != "-"
        assert channel.sign != "-"


def test_a_name_leads_to_one_channel_whatever_the_case() -> None:
    leads_to: dict[str, set[str]] = {}
    for channel in EVERYTHING.values():
        for name in channel.names:
            leads_to.setdefault(name.lower(), set()).add(channel.name)
    assert {name: channels for name, channels in leads_to.items() if len(channels) > 1} == {}
    assert len(EVERYTHING) > 800
    assert len({c.alias for c in EVERYTHING.values() if c.alias}) > 500


def test_names_are_words_in_small_letters() -> None:
    for name in EVERYTHING:
        assert re.fullmatch(r"[a-z][a-z0-9_]*|[qv] .+", name), name
        assert EVERYTHING[name].name == name


@pytest.mark.parametrize("change", [str, str.lower, str.upper])
def test_every_name_and_alias_is_found_whatever_the_case(change: object) -> None:
    for channel in standard().values():
        for name in channel.names:
            assert find(change(name), standard()) is channel


@pytest.mark.parametrize(
    ("alias", "name"),
    [
        ("RootMyc1", "root_moment_out_of_plane_1"),
        ("RootMxc3", "root_moment_in_plane_3"),
        ("RootMyb2", "root_moment_flap_2"),
        ("TwrBsMyt", "tower_base_moment_fore_aft"),
        ("OoPDefl1", "tip_out_of_plane_1"),
        ("B2N13Alpha", "node_13_alpha_2"),
        ("GenPwr", "generator_power"),
        ("BldPitch2", "pitch_2"),
        ("PtchPMzc2", "pitch_2"),
        ("BlPitch3", "pitch_3"),
        ("TipDxc1", "tip_out_of_plane_1"),
        ("RootMOoP2", "root_moment_out_of_plane_2"),
        ("LSShftMxa", "rotor_torque"),
        ("LSShftPwr", "rotor_power"),
        ("HSShftV", "generator_speed"),
        ("YawPzn", "nacelle_yaw"),
        ("YawBrTDxt", "tower_top_fore_aft"),
        ("RtAeroFxh", "rotor_aero_thrust"),
        ("AB2N013Alpha", "node_13_alpha_2"),
        ("B2N013Alpha", "node_13_alpha_2"),
        ("Spn2MLyb3", "station_2_moment_y_3"),
        ("TwHt1MLyt", "tower_station_1_moment_y"),
    ],
)
def test_names_of_openfast(alias: str, name: str) -> None:
    assert find(alias, EVERYTHING).name == name


def test_further_names_are_those_of_the_same_quantity() -> None:
    """The table of OpenFAST's names that comes with openfast_io says the same of all names of a channel."""
    table = pytest.importorskip("openfast_io.FAST_vars_out")
    lines = Path(table.__file__).read_text(encoding="utf-8").splitlines()
    said = {}
    for line in lines:
        if found := re.match(r"(?:ElastoDyn|ServoDyn|AeroDyn)\['(\w+)'\]\s*= \w+\s*# (.*)", line):
            said[found[1]] = found[2].strip()
    compared = 0
    for channel in catalogue(ChannelSet(1)).values():
        for name in channel.also:
            assert said[name] == said[channel.alias], name
            compared += 1
    assert compared >= 50


def test_a_channel_keeps_its_name_where_axes_differ() -> None:
    """OpenFAST's deflections of the yaw bearing in its own tilting axes are no deflections in those of the base."""
    assert "YawBrTDxp" not in {name for c in EVERYTHING.values() for name in c.names}


def test_each_blade_and_node_has_its_own_place() -> None:
    places = Counter((c.source, c.index) for c in EVERYTHING.values())
    assert [place for place, n in places.items() if n > 1] == []
    assert find("B3N20Cl", EVERYTHING).index == (2, 19)
    assert find("station_2_moment_y_3", EVERYTHING).index == (2, 1)
    # the tower base is the first station of the tower
    assert find("tower_station_1_moment_y", EVERYTHING).index == (1,)
    assert find("TwrBsMyt", EVERYTHING).index == (0,)


def test_places_exist_in_the_signals() -> None:
    for channel in EVERYTHING.values():
        array, row = channel.source
        if array in SIGNALS:
            table = SIGNALS[array]
            assert row in table.names, channel.name
            assert len(channel.index) == len(table.axes), channel.name
        else:
            assert array in ("q", "v")


def test_units_are_those_of_the_signals() -> None:
    for channel in EVERYTHING.values():
        array, row = channel.source
        if array in SIGNALS:
            table = SIGNALS[array]
            assert channel.unit == table.rows[table.index(row)].unit, channel.name


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        ("rotor_speed", "rpm"),
        ("generator_speed", "rpm"),
        ("pitch_1", "deg"),
        ("pitch_rate_1", "deg/s"),
        ("azimuth", "deg"),
        ("generator_power", "kW"),
        ("root_moment_out_of_plane_1", "kN m"),
        ("rotor_thrust", "kN"),
        ("wind_x", "m/s"),
        ("node_1_normal_force_1", "N/m"),
    ],
)
def test_units_for_people(name: str, unit: str) -> None:
    channel = EVERYTHING[name]
    shown, factor = channel.display_unit
    assert shown == unit
    if channel.unit in FIELD and name != "pitch_rate_1":
        assert factor == FIELD[channel.unit][1]


def test_angles_that_turn_are_wrapped() -> None:
    assert [c.name for c in EVERYTHING.values() if c.wrap] == ["azimuth"]


def test_what_everyone_wants_exists() -> None:
    assert set(MAIN_CHANNELS) <= set(DEFAULT) <= set(standard())
    assert set(POWER_CURVE) <= set(standard())
    assert len(DEFAULT) == len(set(DEFAULT))


def test_two_blades_have_no_third() -> None:
    two = catalogue(ChannelSet(2, 5, 1, 1))
    assert not any(name.endswith("_3") and c.source[0] != "tower_station" for name, c in two.items())
    assert {c.index[0] for c in two.values() if c.source[0] == "root"} == {0, 1}


def test_the_number_of_channels() -> None:
    machine, blade, node, station, tower = 71, 20, 12, 6, 6
    assert len(catalogue(ChannelSet(0))) == machine
    assert len(standard()) == machine + 3 * blade
    assert len(catalogue(ChannelSet(2, 7, 3, 4))) == machine + 2 * (blade + 7 * node + 3 * station) + 4 * tower


def test_every_coordinate_is_a_channel(model: Model) -> None:
    channels = model_channels(model, Stations(blade=(20.0,), tower=(43.8,)))
    found = {c.source for c in channels.values() if c.source[0] == "q"}
    assert found == {("q", name) for name in model.coordinates}
    assert channels["q blade 1 1st flap"].unit == "m"
    assert channels["q generator"].unit == "rad"
    assert channels["station_1_moment_y_3"].index == (2, 0)


def test_every_velocity_is_a_channel(model: Model) -> None:
    found = {c.source for c in model_channels(model).values() if c.source[0] == "v"}
    assert found == {("v", name) for name in model.coordinates}


# names that are not there


@pytest.mark.parametrize(
    ("name", "near"),
    [
        ("RootMyc4", "RootMyc1"),
        ("RotSped", "RotSpeed"),
        ("rotor_sped", "rotor_speed"),
        ("tower_base_moment_foreaft", "tower_base_moment_fore_aft"),
        ("GENPWER", "GenPwr"),
        ("wind", "wind_x"),
    ],
)
def test_a_misspelt_name_gets_the_closest(name: str, near: str) -> None:
    with pytest.raises(InputError, match=f"no channel '{name}': did you mean .*{near}"):
        find(name, standard())


def test_a_name_like_no_other_says_so() -> None:
    with pytest.raises(InputError, match=r"no channel 'zzzz': none of the \d+ valid names is close to it"):
        find("zzzz", standard())


@pytest.mark.parametrize(
    ("name", "nodes"), [("B1N21Alpha", 20), ("node_0_alpha_1", 20), ("b3n99cl", 20), ("AB1N021Alpha", 20)]
)
def test_nodes_that_are_not_there_are_answered_with_their_number(name: str, nodes: int) -> None:
    with pytest.raises(InputError, match=f"Blade nodes are numbered 1 to {nodes}"):
        find(name, EVERYTHING)


@pytest.mark.parametrize("name", ["power_coefficient", "RtAeroCp", "rain_power_loss"])
def test_channels_of_another_kind_of_turbine_are_told(name: str) -> None:
    with pytest.raises(InputError, match=f"no channel '{name}': only a power-coefficient turbine has it"):
        find(name, standard())
    assert find(name, every_kind()).source[0] == "disk_flow"


def test_an_empty_name_is_no_channel() -> None:
    with pytest.raises(InputError, match="no channel ''"):
        find("", standard())


# what a run records


def test_channels_are_chosen_once_and_in_order(model: Model) -> None:
    chosen = choose(model, ["RootMyc1", "wind_x", "root_moment_out_of_plane_1", "WIND1VELX"], Stations())
    assert [c.name for c in chosen] == ["root_moment_out_of_plane_1", "wind_x"]


def test_all_are_all_but_the_time(model: Model) -> None:
    available = model_channels(model)
    assert [c.name for c in choose(model, ["all"], Stations())] == [name for name in available if name != "time"]


def test_a_turbine_with_two_blades_records_what_it_has_of_the_default(turbine: Turbine) -> None:
    two = build(turbine.replace(n_blades=2), ModelOptions(blade_nodes=5, tower_nodes=3))
    names = [c.name for c in choose(two, DEFAULT, Stations())]
    assert names == [name for name in DEFAULT if not name.endswith("_3")]
    with pytest.raises(InputError, match="no channel 'RootMyc3'"):
        choose(two, ["RootMyc3"], Stations())
