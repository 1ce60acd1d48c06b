"""Decks for OpenFAST: keywords in its order, the same turbine when read back, by us and by openfast_io."""

from __future__ import annotations

import math
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from meltemi import (
    BEDDOES,
    Environment,
    InputError,
    ModelOptions,
    SteadyWind,
    Turbine,
    UnsupportedError,
    build,
    load_turbine,
)
from meltemi.environment import Air, Rain, TimeSeries, air_density
from meltemi.exchange.openfast import Deck, read_deck
from meltemi.exchange.openfast.text import key, read_input
from meltemi.exchange.openfast_writer.sections import principal
from meltemi.exchange.openfast_writer.template import fill
from meltemi.exchange.openfast_writer.writer import ExportedDeck
from meltemi.io import write_openfast as write
from meltemi.structure.beam import section_axes
from meltemi.verification.table import reference_table

FILES = {
    "main": "nrel5mw.fst",
    "ElastoDyn": "ElastoDyn.dat",
    "ElastoDyn blade": "ElastoDyn_blade.dat",
    "ElastoDyn tower": "ElastoDyn_tower.dat",
    "BeamDyn": "BeamDyn.dat",
    "AeroDyn": "AeroDyn.dat",
    "AeroDyn blade": "AeroDyn_blade.dat",
    "airfoil": "Airfoils/du21.dat",
    "InflowWind": "InflowWind.dat",
    "ServoDyn": "ServoDyn.dat",
}
WIND_KEYS = ("PropagationDir", "VFlowAng", "HWindSpeed")
PITCH_ACTUATOR = ("usepitchact", "pitchj", "pitchk", "pitchc")
"""Of BeamDyn before OpenFAST 5, which ends at these lines (OpenFAST pull request 3105)."""


@pytest.fixture(scope="module")
def written(turbine: Turbine, tmp_path_factory: pytest.TempPathFactory) -> ExportedDeck:
    return write(turbine, tmp_path_factory.mktemp("deck"))


@pytest.fixture(scope="module")
def bent(turbine: Turbine) -> Turbine:
    """The same blade as 6 x 6 matrices with couplings, prebent, and damped over stiffness."""
    s = turbine.blade.structure
    assert s.mass is not None and s.edge_stiffness is not None and s.flap_stiffness is not None
    assert s.torsion_stiffness is not None
    n = len(s.position)
    K, M = np.zeros((2, n, 6, 6))
    for i, values in enumerate((5e8, 4e8, 6e9, s.edge_stiffness, s.flap_stiffness, s.torsion_stiffness)):
        K[:, i, i] = values
    K[:, 4, 5] = K[:, 5, 4] = 0.05 * np.sqrt(K[:, 4, 4] * K[:, 5, 5])
    for i, share in enumerate((1.0, 1.0, 1.0, 0.3, 0.1, 0.4)):
        M[:, i, i] = share * s.mass
    axis = -3.0 * (s.position / s.position[-1]) ** 2
    data = turbine.content()
    data["name"] = "bent blade"
    data["blade"]["structure"] = {
        "position": s.position,
        "twist": s.twist,
        "stiffness_matrix": K,
        "mass_matrix": M,
        "axis_x": axis,
        "axis_y": np.zeros(n),
        "damping_time": {"flap": 2e-3, "edge": 1e-3, "torsion": 5e-4},
    }
    a = turbine.blade.aerodynamics
    data["blade"]["aerodynamics"]["centre_x"] = np.interp(a.position, s.position, axis)
    return Turbine.model_validate(data)


def keywords(path: Path) -> list[str]:
    """Keywords in their order, as OpenFAST reads them."""
    entries = [entry for several in read_input(path, "any").entries.values() for entry in several]
    return [key(entry.name) for entry in sorted(entries, key=lambda e: e.line) if not entry.name.startswith("BldNd")]


def differences(one: Any, other: Any, path: str = "") -> list[str]:
    """Key paths at which two descriptions differ by more than the digits of a file."""
    if isinstance(one, dict) and isinstance(other, dict):
        return [d for k in sorted({*one, *other}) for d in differences(one.get(k), other.get(k), f"{path}.{k}")]
    if path.endswith(".source") or (one is None and other is None):
        return []
    atol = 1e-6 if path.endswith(".angle_of_attack") else 1e-12  # whose ends are exactly -pi and pi in a deck
    try:
        same = np.allclose(one, other, rtol=1e-8, atol=atol)
    except (TypeError, ValueError):  # names, or different lengths
        same = one == other
    return [] if same else [path]


@pytest.mark.parametrize("module", FILES)
def test_keywords_are_in_the_order_of_openfast(module: str, written: ExportedDeck) -> None:
    wanted = [row["keyword"] for row in reference_table("openfast_keywords", module=module)]
    assert keywords(written.main.parent / FILES[module]) == [name for name in wanted if name not in PITCH_ACTUATOR]


@pytest.mark.rosco
@pytest.mark.parametrize("module", ["ElastoDyn", "ServoDyn", "AeroDyn", "BeamDyn", "BeamDyn blade"])
def test_keywords_are_those_of_newer_decks(module: str, written: ExportedDeck, rosco_cases: Path) -> None:
    folder = rosco_cases / "IEA-15-240-RWT"
    name = {"BeamDyn": "BeamDyn", "BeamDyn blade": "BeamDyn_blade", "AeroDyn": "AeroDyn15"}.get(module, module)
    kind = "" if "BeamDyn" in module else "-Monopile"
    path = folder / f"IEA-15-240-RWT{kind}" / f"IEA-15-240-RWT{kind}_{name}.dat"
    wanted = keywords(path)
    if module == "BeamDyn":  # its dash touches the keyword there
        wanted.insert(wanted.index("rotstates"), "tngt_stf_difftol")
    found = keywords(written.main.parent / f"{module.replace(' ', '_')}.dat")
    assert found == [name for name in wanted if name not in PITCH_ACTUATOR]


def test_the_turbine_is_the_same_when_read_back(turbine: Turbine, tmp_path: Path) -> None:
    """But for what ElastoDyn does not have, and what the reader takes from the new mode shapes."""
    deck = read_deck(write(turbine, tmp_path, options=ModelOptions(stall_constants=BEDDOES)).main, control_of=turbine)
    assert differences(deck.turbine.content(), turbine.content()) == [
        ".blade.structure.axial_stiffness",
        ".blade.structure.damping.torsion",
        ".blade.structure.mode_shapes",
        ".tower.axial_stiffness",
        ".tower.damping.torsion",
        ".tower.mode_shapes",
        ".tower.torsion_stiffness",
    ]


LOST = {
    "blade.aerodynamics.cant": "cant of the sections",
    "airfoils.*dynamic_stall": "static polars of",
    "airfoils.*": "polars of",
    "blade.structure.axis_*": "prebend and sweep",
    "blade.structure.axial_stiffness": "no shear stiffness",
    "blade.structure.damping.torsion": "torsion of the blade",
    "blade.structure.damping*": "damping of the blade",
    "blade.structure.mode_shapes": "mode of the blade",
    "blade.structure.*": "mass centre and rotary inertia of sections",
    "cut_*": "cut-in and cut-out wind speed",
    "drivetrain.gearbox": "gearbox",
    "nacelle.*_inertia": "roll and nod inertia",
    "tower.axial_stiffness": "torsion and stretching of the tower",
    "tower.damping.torsion": "torsion and stretching of the tower",
    "tower.torsion_stiffness": "torsion and stretching of the tower",
    "tower.mode_shapes": "mode of the tower",
}
"""What may be otherwise when it is read back, and the note that says so."""


@pytest.mark.slow
@pytest.mark.parametrize("beamdyn", [False, True], ids=["elastodyn", "beamdyn"])
@pytest.mark.parametrize("name", ["nrel5mw", "iea15mw", "iea22mw", "zr20-122", "ct30-155"])
def test_every_turbine_of_the_library_comes_back_field_by_field(name: str, beamdyn: bool, tmp_path: Path) -> None:
    """But for what is in the notes of the writer; no field is lost without one."""
    turbine = load_turbine(name)
    written = write(turbine, tmp_path, beamdyn=beamdyn, options=ModelOptions(stall_constants=BEDDOES))
    noted = " ".join(note.what for note in written.notes)
    read = read_deck(written.main, control_of=turbine).turbine
    whole = turbine.blade.structure.stiffness_matrix is not None
    for path in differences(read.content(), turbine.content()):
        key_path = path.lstrip(".")
        words = next((words for pattern, words in LOST.items() if fnmatchcase(key_path, pattern)), "")
        if key_path.startswith("blade.structure") and whole:
            assert not beamdyn, key_path  # BeamDyn has all of the sections
            words = words if "axis" in key_path or "mode" in key_path else "6 x 6"
        elif key_path.startswith("blade.structure") and beamdyn:
            words = "damping of the blade" if "damping" in key_path else "no shear stiffness"
        assert words and words in noted, key_path
    for polar, ours in turbine.airfoils.items():
        for values in ("lift", "drag", "moment"):
            there = np.interp(
                ours.angle_of_attack, read.airfoils[polar].angle_of_attack, getattr(read.airfoils[polar], values)
            )
            np.testing.assert_allclose(there, getattr(ours, values), atol=3e-3 if name == "iea22mw" else 1e-6)


@pytest.mark.long
@pytest.mark.parametrize(("name", "step"), [("nrel5mw", 0.01), ("iea15mw", 0.002), ("iea22mw", 0.0025)])
def test_the_time_step_follows_from_the_highest_frequency(name: str, step: float, tmp_path: Path) -> None:
    """With 10 ms OpenFAST's IEA 15 MW ends at 0.07 s: its shaft has 32 Hz."""

    def steps(folder: str, **how: Any) -> tuple[float, float]:
        file = read_input(write(load_turbine(name), tmp_path / folder, **how).main, "main")
        dt, output = (float(file.require([key], "").values[0]) for key in ("DT", "DT_Out"))
        return dt, output

    assert steps("a") == (step, 0.05)
    assert steps("b", beamdyn=True) == (0.01, 0.05)
    assert steps("c", options=ModelOptions(locked=("drivetrain",)))[0] >= step
    for how in ({"time_step": 0.004}, {"options": ModelOptions(time_step=0.004)}):
        dt, output = steps("d", **how)
        assert dt == 0.004 and output / dt == pytest.approx(round(output / dt), abs=1e-12)


def numbers(folder: Path, file: str, *names: str) -> list[float]:
    """Values of keywords of a written file."""
    read = read_input(folder / file, "any")
    return [float(read.require([name], "").values[0]) for name in names]


@pytest.mark.parametrize(("beamdyn", "coupling"), [(False, 1), (True, 3)], ids=["elastodyn", "beamdyn"])
def test_beamdyn_is_coupled_implicitly(beamdyn: bool, coupling: int, turbine: Turbine, tmp_path: Path) -> None:
    """Loose coupling would need 1 ms; elements of order 5 are coarse for blades of 138 m."""
    write(turbine, tmp_path, beamdyn=beamdyn)
    assert numbers(tmp_path, "nrel5mw.fst", "ModCoupling") == [coupling]
    assert numbers(tmp_path, "BeamDyn.dat", "order_elem") == [10]


def test_the_held_pitch_is_neutral(turbine: Turbine, tmp_path: Path) -> None:
    """Without a controller OpenFAST holds PitNeut, whatever BlPitch is."""
    write(turbine, tmp_path, pitch=0.1)
    held = numbers(tmp_path, "ServoDyn.dat", "PitNeut(1)", "PitNeut(2)", "PitNeut(3)")
    assert held + numbers(tmp_path, "ElastoDyn.dat", "BlPitch(1)") == pytest.approx([math.degrees(0.1)] * 4)


@pytest.mark.slow
@pytest.mark.parametrize("excess", [None, 1.0, 1.000004, 1.08])
def test_openfast_accepts_the_torque_law(excess: float | None, turbine: Turbine, tmp_path: Path) -> None:
    """VS_Rgn2K VS_RtGnSp^2 must not be above VS_RtTq: region 2 ends earlier; optimal gain and rated torque stay."""
    law = turbine.control.torque
    rated = law.rated_power / law.rated_speed
    gain = law.optimal_gain if excess is None else excess * rated / law.rated_speed**2
    written = write(turbine.replace(**{"control.torque.optimal_gain": gain}), tmp_path)
    K, speed, torque = numbers(tmp_path, "ServoDyn.dat", "VS_Rgn2K", "VS_RtGnSp", "VS_RtTq")
    assert K * speed**2 < torque
    assert (K, torque) == pytest.approx((gain * (math.pi / 30.0) ** 2, rated))
    earlier = 1.0 / math.sqrt(max(excess or 0.0, 1.0))
    assert speed * math.pi / 30.0 / law.rated_speed == pytest.approx(earlier, rel=2e-6)
    assert (excess == 1.08) == ("rated speed of the torque law" in {note.what for note in written.notes})


def test_polars_are_fit_for_openfast(turbine: Turbine, tmp_path: Path) -> None:
    """Angles that increase in the file, exactly -180 and 180 degrees, and the same coefficients there."""
    airfoil = turbine.airfoils["du21"]
    alpha = np.array(airfoil.angle_of_attack)
    alpha = np.sort(np.concatenate([alpha, [alpha[40] + 2.8e-12, alpha[-1] - 1e-12, alpha[0] + 1e-12]]))
    values = {k: np.interp(alpha, airfoil.angle_of_attack, getattr(airfoil, k)).tolist() for k in ("drag", "moment")}
    lift = np.interp(alpha, airfoil.angle_of_attack, airfoil.lift)
    lift[-1] = lift[0] + 0.01
    odd = airfoil.replace(angle_of_attack=alpha.tolist(), lift=lift.tolist(), **values)
    airfoils = {**turbine.content()["airfoils"], "du21": odd.content()}
    written = write(turbine.replace(airfoils=airfoils), tmp_path)
    rows = [
        [float(word) for word in line.split()]
        for line in (tmp_path / "Airfoils/du21.dat").read_text().split("Alpha")[1].splitlines()[2:]
    ]
    found = np.array(rows)
    assert len(found) == len(airfoil.lift) and np.all(np.diff(found[:, 0]) > 1e-4)
    assert found[0, 0] == -180.0 and found[-1, 0] == 180.0
    np.testing.assert_array_equal(found[0, 1:], found[-1, 1:])
    noted = [note.why for note in written.notes if note.what == "polars of du21"]
    assert len(noted) == 2


def test_dynamic_stall_ends_before_root_and_tip(turbine: Turbine, tmp_path: Path) -> None:
    for options, wanted in ((ModelOptions(), ("4", "0.25", "0.95")), (ModelOptions(stall="static"), ("0", "0", "1"))):
        write(turbine, tmp_path, options=options)
        file = read_input(tmp_path / "AeroDyn.dat", "AeroDyn")
        found = tuple(file.require([name], "").values[0] for name in ("UA_Mod", "UAStartRad", "UAEndRad"))
        assert found == wanted


def test_matrices_are_the_same_when_read_back(bent: Turbine, tmp_path: Path) -> None:
    done = write(bent, tmp_path, beamdyn=True, options=ModelOptions(stall_constants=BEDDOES))
    deck = read_deck(done.main, control_of=bent)
    assert deck.turbine.name == "bent_blade"
    assert differences(deck.turbine.content(), bent.content()) == [
        ".blade.aerodynamics.cant",
        ".name",
        ".tower.axial_stiffness",
        ".tower.damping.torsion",
        ".tower.mode_shapes",
        ".tower.torsion_stiffness",
    ]


def test_cant_and_the_mass_at_the_tower_top_are_written(turbine: Turbine, tmp_path: Path) -> None:
    cant = np.linspace(0.0, -0.1, len(turbine.blade.aerodynamics.position)).tolist()
    mine = turbine.replace(**{"blade.aerodynamics.cant": cant, "tower.top_mass": 28000.0})
    read = read_deck(write(mine, tmp_path).main, control_of=turbine).turbine
    np.testing.assert_allclose(read.blade.aerodynamics.cant, cant, atol=1e-12)
    assert read.tower.top_mass == 28000.0 and read.nacelle.mass == turbine.nacelle.mass


def test_elastodyn_says_what_it_does_not_have(bent: Turbine, tmp_path: Path) -> None:
    text = " ".join(note.what for note in write(bent, tmp_path).notes)
    for what in ("prebend", "torsion of the blade", "6 x 6", "1st flap mode", "control"):
        assert what in text
    silent = " ".join(note.what for note in write(bent, tmp_path, beamdyn=True).notes)
    assert "prebend" not in silent and "6 x 6" not in silent


@pytest.fixture(scope="module")
def plain(turbine: Turbine, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    return options_read(tmp_path_factory.mktemp("plain"), turbine, stall_constants=BEDDOES).options


def options_read(folder: Path, turbine: Turbine, **options: Any) -> Deck:
    return read_deck(write(turbine, folder, options=ModelOptions(**options)).main, control_of=turbine)


@pytest.mark.long
@pytest.mark.parametrize(
    "changed",
    [
        {"inflow": "quasi_steady"},
        {"inflow": "constant", "inflow_time": 7.0},
        {"stall": "static"},
        {"tip_loss": False},
        {"hub_loss": False},
        {"axial_drag": True},
        {"tangential_drag": True},
        {"skew": "none"},
        {"wake": "none", "inflow": "quasi_steady"},
        {"tower_influence": "none"},
        {"tower_drag": False},
        {"locked": ("drivetrain",)},
        {"locked": ("generator", "yaw")},
        {"flap_modes": 1, "edge_modes": 0},
        {"fore_aft_modes": 1, "side_side_modes": 0},
        {"stall_constants": {**BEDDOES.model_dump(), "pressure_lag": 1.5}},
    ],
    ids=lambda changed: "-".join(changed),
)
def test_options_are_those_of_the_deck(
    changed: dict[str, Any], turbine: Turbine, plain: dict[str, Any], tmp_path: Path
) -> None:
    read = options_read(tmp_path, turbine, **{"stall_constants": BEDDOES, **changed}).options
    assert {name: read[name] for name in changed} == changed
    assert all(plain.get(name) != value for name, value in changed.items())
    for ours, theirs in ((read, plain), (read["advanced"], plain["advanced"])):
        same = (ours.keys() & theirs.keys()) - changed.keys() - {"advanced"}
        assert all(ours[name] == theirs[name] for name in same)


def test_run_and_site(turbine: Turbine, tmp_path: Path) -> None:
    deck = read_deck(
        write(
            turbine,
            tmp_path,
            environment=Environment(air_density=1.1, gravity=9.7),
            wind=SteadyWind(speed=9.0, shear_exponent=0.2, direction=0.1, upflow=0.05),
            duration=33.0,
            time_step=0.004,
            rotor_speed=1.1,
            pitch=0.02,
            azimuth=-0.5,
        ).main,
        control_of=turbine,
    )
    assert deck.environment == pytest.approx({"air_density": 1.1, "gravity": 9.7})
    assert deck.wind is not None
    assert deck.wind.pop("kind") == "steady"
    assert deck.wind == pytest.approx({"speed": 9.0, "shear_exponent": 0.2, "direction": 0.1, "upflow": 0.05})
    assert deck.duration == 33.0 and deck.start == pytest.approx({"rotor_speed": 1.1, "pitch": 0.02, "azimuth": -0.5})
    assert "0.004   DT " in (tmp_path / "nrel5mw.fst").read_text()


@pytest.mark.slow
def test_a_wind_file_is_named(turbine: Turbine, tmp_path: Path) -> None:
    (tmp_path / "field.bts").write_bytes(b"")
    deck = read_deck(write(turbine, tmp_path, wind=tmp_path / "field.bts").main, control_of=turbine)
    assert deck.wind == {"kind": "file", "file": str(tmp_path / "field.bts")}
    with pytest.raises(InputError, match=r"expected a SteadyWind or a TurbSim file"):
        write(turbine, tmp_path, wind="field.wnd")


def test_a_controller_library_is_named(turbine: Turbine, tmp_path: Path) -> None:
    deck = read_deck(write(turbine, tmp_path, library="libdiscon.so", settings="mine.IN").main, control_of=turbine)
    assert deck.library["library"] == "libdiscon.so"
    text = (tmp_path / "ServoDyn.dat").read_text()
    assert '"mine.IN"   DLL_InFile' in text


def test_the_simple_law_is_ours_up_to_rated(turbine: Turbine, written: ExportedDeck) -> None:
    """Region 2 meets region 2 1/2, and that the rated torque, at our speeds."""
    file = read_input(written.main.parent / "ServoDyn.dat", "ServoDyn")
    speed, torque, gain, slip = (
        float(file.require([name], "").values[0]) for name in ("VS_RtGnSp", "VS_RtTq", "VS_Rgn2K", "VS_SlPc")
    )
    law = turbine.control.torque
    assert speed * math.pi / 30.0 == pytest.approx(law.rated_speed)
    assert torque * law.rated_speed == pytest.approx(law.rated_power)
    assert gain * 1000.0**2 == pytest.approx(law.optimal_gain * (1000.0 * math.pi / 30.0) ** 2)
    assert slip == pytest.approx(100.0 * law.slip)


def test_polynomials_give_our_frequencies(turbine: Turbine, written: ExportedDeck) -> None:
    """In our own model with given shapes: the blade as in the notes, the tower to 0.1 %."""
    shapes = read_deck(written.main, control_of=turbine).turbine
    assert shapes.blade.structure.mode_shapes is not None and shapes.tower.mode_shapes is not None
    for polynomials in (shapes.blade.structure.mode_shapes.flap, shapes.tower.mode_shapes.side_side):
        assert len(polynomials) == 2
        np.testing.assert_allclose([sum(c) for c in polynomials], 1.0, atol=1e-9)
    as_elastodyn = {f"blade.structure.{name}": None for name in ("torsion_stiffness", "flap_inertia", "edge_inertia")}
    given = build(shapes.replace(**as_elastodyn), ModelOptions(mode_shapes="given")).rotor.blade
    ratio = given.modes.frequency / build(turbine, ModelOptions(torsion_modes=0)).rotor.blade.modes.frequency
    assert np.all(ratio > 1.0) and np.all(ratio < 1.011)
    noted = [note.why for note in written.notes if "mode of the blade" in note.what]
    assert [float(why.split("frequency ")[1].split(" %")[0]) for why in noted] == pytest.approx(
        (100.0 * (ratio - 1.0)).tolist(), abs=0.006
    )


def test_shapes_that_are_given_are_written(turbine: Turbine, tmp_path: Path) -> None:
    flap, edge = ((0.1, 0.2, 0.3, 0.2, 0.2), (0.5, 0.5, 0.5, -0.5, 0.0)), ((0.2, 0.2, 0.2, 0.2, 0.2),)
    mine = turbine.replace(**{"blade.structure.mode_shapes": {"flap": flap, "edge": edge}})
    read = read_deck(write(mine, tmp_path).main, control_of=turbine).turbine.blade.structure.mode_shapes
    assert read is not None and read.flap == flap and read.edge == edge


def test_principal_axes_of_a_turned_section() -> None:
    """A section whose axes are turned to feather by an angle is found there."""
    for angle in (-0.6, 0.2):
        K = np.diag([4e8, 3e8, 5e9, 7e9, 2e9, 1e9])[None]
        Q = section_axes(np.array([angle]), np.array([[0.0, 0.0, 1.0]]))
        flap, edge, found = principal(Q @ K @ Q.transpose(0, 2, 1))
        assert (flap[0], edge[0], found[0]) == pytest.approx((2e9, 7e9, angle))


def test_stated_constants_of_airfoils(turbine: Turbine, tmp_path: Path) -> None:
    stated = turbine.replace(**{"airfoils.du21.zero_lift_angle": -0.07, "airfoils.du21.zero_lift_drag": 0.006})
    deck = read_deck(write(stated, tmp_path, options=ModelOptions(stall_constants=BEDDOES)).main, control_of=turbine)
    found = deck.turbine.airfoils["du21"]
    assert found.zero_lift_angle == pytest.approx(-0.07) and found.zero_lift_drag == pytest.approx(0.006)
    file = read_input(tmp_path / "Airfoils/du21.dat", "airfoil")
    constants = {name: float(file.require([name], "").values[0]) for name in ("alpha1", "alpha2", "C_nalpha", "Cn1")}
    # the reference deck has 8, -8, 6.2047 and 1.4144, fitted by hand
    assert 5.0 < constants["alpha1"] < 15.0 and -15.0 < constants["alpha2"] < -5.0
    assert 5.5 < constants["C_nalpha"] < 7.5 and 0.8 < constants["Cn1"] < 1.8


def test_what_cannot_be_written(turbine: Turbine, tmp_path: Path) -> None:
    data = turbine.content()
    data["blade"]["structure"]["torsion_stiffness"] = None
    with pytest.raises(UnsupportedError, match="torsion_stiffness"):
        write(Turbine.model_validate(data), tmp_path, beamdyn=True)
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        write(turbine, tmp_path / "file")


def test_unknown_keywords_are_refused() -> None:
    with pytest.raises(KeyError, match="HubMas"):
        fill("ElastoDyn", "", {"HubMas": 1.0}, {"outputs": ()})


def test_openfast_io_reads_the_same_numbers(
    turbine: Turbine, written: ExportedDeck, bent: Turbine, tmp_path: Path
) -> None:
    reader = pytest.importorskip("openfast_io.FAST_reader")
    for described, path in ((turbine, written.main), (bent, write(bent, tmp_path, beamdyn=True).main)):
        deck = reader.InputReader_OpenFAST()
        deck.FAST_InputFile, deck.FAST_directory = path.name, str(path.parent)
        deck.execute()
        found = deck.fst_vt
        elastodyn, blade, tower = found["ElastoDyn"], found["AeroDynBlade"], found["ElastoDynTower"]
        blade = blade[0] if isinstance(blade, list) else blade
        assert elastodyn["TipRad"] == pytest.approx(described.rotor_radius)
        assert elastodyn["NacYIner"] == pytest.approx(described.nacelle.yaw_inertia)
        np.testing.assert_allclose(np.radians(blade["BlTwist"]), described.blade.aerodynamics.twist, atol=1e-9)
        np.testing.assert_allclose(tower["TMassDen"], described.tower.mass)
        assert len(found["AeroDyn"]["af_data"]) == len(set(described.blade.aerodynamics.airfoil))
        assert found["ServoDyn"]["YawSpr"] == pytest.approx(described.yaw.stiffness)
    matrices = found["BeamDynBlade"]
    matrices = matrices[0] if isinstance(matrices, list) else matrices
    np.testing.assert_allclose(matrices["beam_stiff"], bent.blade.structure.stiffness_matrix, rtol=1e-9)
    np.testing.assert_allclose(matrices["beam_inertia"], bent.blade.structure.mass_matrix, rtol=1e-9)


@pytest.mark.slow
def test_weather_that_a_deck_does_not_have(turbine: Turbine, tmp_path: Path) -> None:
    still = Environment(air=Air(temperature=30.0))
    assert not {"rain", "weather that changes"} & {
        note.what for note in write(turbine, tmp_path, environment=still).notes
    }
    series = TimeSeries(time=[0.0, 9.0], value=[30.0, 0.0])
    weather = Environment(air=Air(temperature=series), rain=Rain(kind="light"))
    written = write(turbine, tmp_path, environment=weather)
    assert {"rain", "weather that changes"} <= {note.what for note in written.notes}
    assert read_deck(written.main, control_of=turbine).environment["air_density"] == pytest.approx(
        float(air_density(30.0)), rel=1e-6
    )


@pytest.mark.parametrize(("yaw", "direction", "upflow"), [(-20.0, 20.0, 8.0), (15.0, -170.0, -5.0), (0.0, 200.0, 0.0)])
def test_angles_of_wind_and_nacelle_return(
    turbine: Turbine, tmp_path: Path, yaw: float, direction: float, upflow: float
) -> None:
    """PropagationDir is clockwise as our direction, NacYaw and YawNeut counter-clockwise as our yaw; HWindSpeed lies
    along the inclined flow."""
    options = ModelOptions(nacelle_yaw=math.radians(yaw))
    wind = SteadyWind(speed=9.0, direction=math.radians(direction), upflow=math.radians(upflow))
    written = write(turbine, tmp_path, options=options, wind=wind)
    values = {
        name: float(entry.values[0])
        for file, names in (("ElastoDyn", ("NacYaw",)), ("ServoDyn", ("YawNeut",)), ("InflowWind", WIND_KEYS))
        for name in names
        if (entry := read_input(tmp_path / FILES[file], "any").find(name))
    }
    turned = math.remainder(direction, 360.0)
    expected = (yaw, yaw, turned, upflow, 9.0 / math.cos(math.radians(upflow)))
    assert tuple(values.values()) == pytest.approx(expected, rel=1e-5)
    deck = read_deck(written.main, control_of=turbine)
    assert math.degrees(deck.options.get("nacelle_yaw", 0.0)) == pytest.approx(yaw)
    assert deck.wind is not None
    back = [math.degrees(deck.wind.get(name, 0.0)) for name in ("direction", "upflow")]
    assert back == pytest.approx([turned, upflow], rel=1e-5)
    assert deck.wind["speed"] == pytest.approx(9.0, rel=1e-5)


def test_the_direction_of_a_wind_file_returns(turbine: Turbine, tmp_path: Path) -> None:
    (tmp_path / "field.bts").touch()
    written = write(turbine, tmp_path / "deck", wind=tmp_path / "field.bts", direction=math.radians(25.0))
    deck = read_deck(written.main, control_of=turbine)
    file = str((tmp_path / "field.bts").absolute())
    assert deck.wind == {"kind": "file", "file": file, "direction": pytest.approx(math.radians(25.0))}
