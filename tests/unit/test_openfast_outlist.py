"""Channels of OpenFAST's lists of outputs: each is one of meltemi's, or named as not available."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

import meltemi
from meltemi import InputError
from meltemi.cases.recordable import recordable
from meltemi.exchange.deck_case import deck_case
from meltemi.exchange.openfast.outlist import requested
from meltemi.exchange.openfast.text import InputFile
from meltemi.simulation.channels import ChannelSet, catalogue, channels_of_group, find, standard
from meltemi.simulation.openfast_only import openfast_only, why_missing

GROUPS = ("disk", "sea", "frame", "platform")
EVERY = catalogue(
    ChannelSet(
        nodes=100,
        blade_stations=9,
        tower_stations=9,
        further=(
            *(channel for group in GROUPS for channel in channels_of_group(group)),
            *channels_of_group("pile_station", 9),
            *channels_of_group("line", 9),
        ),
    )
)
KNOWN = {name.lower() for channel in EVERY.values() for name in channel.names}


@pytest.mark.parametrize(
    ("name", "module"),
    [
        ("NcIMUTAxs", "ElastoDyn"),
        ("-NcIMUTAxs", "ElastoDyn"),
        ("Q_B1E1", "ElastoDyn"),
        ("QD2_TFA1", "ElastoDyn"),
        ("Spn4ALxb2", "ElastoDyn"),
        ("HSShftPwr", "ElastoDyn"),
        ("B1WvsF1xi", "HydroDyn"),
        ("B1WvsFxi", "HydroDyn"),
        ("B1WvsF2xi", "HydroDyn"),
        ("PRPSurge", "HydroDyn"),
        ("M1N3FBzi", "HydroDyn"),
        ("J2WaveElv1", "HydroDyn"),
        ("RtFldFxg", "AeroDyn"),
        ("B1N3STVx", "AeroDyn"),
        ("AB1N003Vindxi", "AeroDyn"),
        ("TwN9VUndy", "AeroDyn"),
        ("B1RootFxr", "BeamDyn"),
        ("B2N001_FFgxl", "BeamDyn"),
        ("BStC1_B2_Fzi", "ServoDyn"),
        ("Wave2Elev", "SeaState"),
        ("FVel1xi", "SeaState"),
        ("M1N2RDxe", "SubDyn"),
        ("SSQMDD07", "SubDyn"),
        ("IntfTAzss", "SubDyn"),
        ("WindHubVelXY", "InflowWind"),
        ("L3N20T", "MoorDyn"),
        ("Con4Fz", "MoorDyn"),
        ("Body2RVx", "MoorDyn"),
    ],
)
def test_channels_of_openfast_alone(name: str, module: str) -> None:
    """Names from ``ValidParamAry`` of OpenFAST 5.0's modules, and from the rules of MoorDyn."""
    words = why_missing(name)
    assert words is not None and f"of {module} " in words
    with pytest.raises(InputError, match=f"of {module} "):
        find(name, EVERY)


@pytest.mark.parametrize("name", "NcIMUTAx B1WvsF1x RotSped B1N3Alhpa TwHt1MLyy RootMyc4 wind PtfmPich Q_B1G1".split())
def test_names_that_openfast_has_neither(name: str) -> None:
    assert why_missing(name) is None
    with pytest.raises(InputError, match=r"did you mean|the names are|expected|known"):
        recordable([name], EVERY)


def test_every_name_of_openfast_io_is_known_or_explained() -> None:
    """The lists of channels that come with openfast_io, of OpenFAST's own spreadsheet."""
    table = pytest.importorskip("openfast_io.FAST_vars_out").FstOutput
    nodal = {"AeroDyn_Nodes": "AB1N001", "BeamDyn_Nodes": "B1N001_", "ElastoDyn_Nodes": "B1N001"}
    unknown = [
        (module, name)
        for module, names in table.items()
        for name in names
        if (full := nodal.get(module, "") + name).lower() not in KNOWN and why_missing(full) is None
    ]
    assert not unknown
    assert sum(map(len, table.values())) > 5000


def test_what_comes_near_exists() -> None:
    """Channels to which the table points, except coordinates, whose names are those of a model."""
    for kind in openfast_only().values():
        for name in filter(None, kind.instead.split("; ")):
            assert name in EVERY or "<" in name or name == "v yaw", kind


def test_a_run_goes_without_what_it_has_not() -> None:
    names = ("RotSpeed", "NcIMUTAxs", "FAIRTEN1", "PtfmSurge", "all", "pitch_3")
    recorded, missing = recordable(names, standard())
    assert recorded == ("RotSpeed", "all", "pitch_3")
    assert set(missing) == {"NcIMUTAxs", "FAIRTEN1", "PtfmSurge"}
    with pytest.raises(InputError, match="RotSped"):
        recordable(["RotSpeed", "RotSped"], standard())


def test_lists_as_openfast_reads_them() -> None:
    text = """------- OUTPUT --------
True SumPrint - Print summary
              OutList - The next lines
"RotSpeed, GenSpeed; -TwrBsMyt"  - three
GenTq  and what follows is a comment
! BldPitch1
'Azimuth'
END of input file (the word "END" must appear in the first 3 columns)
              OutList - of nodes
"Alpha"
END
"""
    file = InputFile(Path("a.dat"), "ElastoDyn", tuple(text.splitlines()))
    assert list(requested(file)) == [
        (4, "RotSpeed"),
        (4, "GenSpeed"),
        (4, "-TwrBsMyt"),
        (5, "GenTq"),
        (7, "Azimuth"),
    ]
    text = "--- OUTPUTS ---\nFairTen1, AnchTen1\nL1N2px\nEND\n------ need this line ---"
    file = InputFile(Path("a.dat"), "mooring", tuple(text.splitlines()))
    assert [name for _, name in requested(file)] == ["FairTen1", "AnchTen1", "L1N2px"]


def test_the_lists_of_a_deck_go_with_its_case(openfast_deck: Path, tmp_path: Path, turbine: meltemi.Turbine) -> None:
    """By node and gage: ``BlOutNd`` 1, 9, 19 and ``BldGagNd`` 5, 9, 13 of 17 elements of a blade of 61.5 m."""
    folder = tmp_path / "deck"
    shutil.copytree(openfast_deck, folder)
    for name, old, new in (
        ("AeroDyn.dat", "OutList -", 'OutList -\n"B1N3Alpha, B2N1Cl"\n"mRtSkew"\n"B1N4Alpha"\n"RtSkwe"'),
        ("AeroDyn.dat", "0 NBlOuts", "3 NBlOuts"),
        ("ElastoDyn.dat", "OutList -", 'OutList -\n"RotSpeed"\n"Spn2MLyb1"\n"Spn3MLxb2"\n"NcIMUTAxs"'),
    ):
        text = (folder / name).read_text()
        assert old in text, old
        (folder / name).write_text(text.replace(old, new, 1))
    deck = meltemi.io.read_deck(folder / "5MW.fst", control_of=turbine)
    case = deck_case(deck, "turbine.yaml")
    assert {"node_19_alpha_1", "node_1_lift_2", "skew_angle", "station_2_moment_y_1", "rotor_speed"} <= {*case.channels}
    assert case.blade_stations == pytest.approx([(n - 0.5) / 17 * 61.5 for n in (5, 9, 13)])
    assert not {name for name in case.channels if name.startswith("tower_station")}
    ignored = {note.what: note.why for note in deck.noted("ignored") if note.what.startswith("OutList: ")}
    assert any("NcIMUTAxs" in what for what in ignored)
    assert "has it neither" in ignored["OutList: RtSkwe"]
    assert any("B1N4Alpha" in what for what in ignored), "of three output nodes"
