"""Load surrogates: space and designs, fits of known functions, lifetime loads in closed form, files, sites."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from meltemi.core.errors import InputError
from meltemi.loads.surrogate.campaign import (
    SurrogateCampaign,
    SurrogateDesign,
    surrogate_design,
    write_surrogate_campaign,
)
from meltemi.loads.surrogate.fit import Fit, fit_surrogate, further_points, gaussian_fit, polynomial_fit, seed_scatter
from meltemi.loads.surrogate.model import (
    LoadModel,
    Polynomials,
    Surrogate,
    _checksum,
    legendre_products,
    load_surrogate,
    write_surrogate,
)
from meltemi.loads.surrogate.report import fit_rows, suitability_rows, value_rows
from meltemi.loads.surrogate.site import Sector, SiteTable, class_table, conditions_of, lifetime_loads, site_suitability
from meltemi.loads.surrogate.space import SiteVariable, Space, site_space, space_filling
from meltemi.turbine.library import load_turbine, write_turbine

RNG = np.random.default_rng(1)
SPACE = site_space(hub_height=90.0, rotor_radius=63.0, cut_in=3.0, cut_out=25.0, rated_power=5e6)
PLANE = Space((SiteVariable("speed", (3.0,), (25.0,)), SiteVariable("turbulence_intensity", (0.05,), (0.35,))))


def model(fit: Fit, space: Space = PLANE, slope: float = 4.0, scatter: float = 0.0) -> LoadModel:
    return LoadModel("load", "N m", slope, space, fit.basis, fit.coefficients, scatter, {})


def linear(*coefficients: float, scatter: float = 0.0, slope: float = 4.0, draws: float = 0.0) -> Surrogate:
    """A surrogate whose logarithm is linear in speed [m/s] and intensity: c0 + c1 U + c2 I."""
    c0, c1, c2 = coefficients
    degrees = np.array([[0, 0], [1, 0], [0, 1]])
    row = np.array([c0 + 14.0 * c1 + 0.2 * c2, 11.0 * c1 / math.sqrt(3.0), 0.15 * c2 / math.sqrt(3.0)])
    rows = row + draws * np.array([[0.0], [1.0], [-1.0]]) * [0.0, 0.0, 1.0]
    own = LoadModel("tower", "N m", slope, PLANE, Polynomials(degrees), rows, scatter, {})
    return Surrogate("made", PLANE, {"tower": own}, {})


def test_bounds_depend_on_the_wind_speed_as_published() -> None:
    low, high = SPACE.bounds(np.array([10.0, 25.0]))
    turbulence, shear = SPACE.names.index("turbulence_intensity"), SPACE.names.index("shear_exponent")
    assert high[:, turbulence] == pytest.approx([0.18 * (6.8 + 0.75 * u + 3.0 * (10.0 / u) ** 2) / u for u in (10, 25)])
    assert high[1, shear] == pytest.approx(0.22 + 0.4 * 63.0 / 90.0)
    assert low[1, shear] == pytest.approx(0.15 - 0.23 * (1.0 - (0.4 * math.log(63.0 / 90.0)) ** 2))
    assert low[0, turbulence] == 0.025 and low[0, shear] == -0.3  # the limit


def test_germ_and_values_are_inverse() -> None:
    germ = RNG.uniform(-1.0, 1.0, (50, 6))
    assert SPACE.germ(SPACE.points(germ)) == pytest.approx(germ, abs=1e-12)


def test_more_points_continue_a_sobol_sequence_and_fill_better_than_chance() -> None:
    one, more = space_filling(4, 32, seed=3), space_filling(4, 64, seed=3)
    assert np.array_equal(one, more[:32]) and not np.array_equal(one, space_filling(4, 32, seed=4))
    for method in ("sobol", "latin"):
        germ = space_filling(3, 64, method)
        counts = np.histogram(germ[:, 1], 64, (-1.0, 1.0))[0]
        assert np.all(counts == 1) and np.abs(germ.mean(axis=0)).max() < 0.02
    with pytest.raises(InputError, match="did you mean 'sobol'"):
        space_filling(2, 4, "sobl")


def test_legendre_products_are_orthonormal() -> None:
    x, w = np.polynomial.legendre.leggauss(8)
    germ = np.stack(np.meshgrid(x, x), axis=-1).reshape(-1, 2)
    weight = np.outer(w, w).ravel() / 4.0
    values = legendre_products(germ, np.array([[0, 0], [1, 0], [3, 2], [0, 4]]))
    assert values.T @ (weight[:, None] * values) == pytest.approx(np.eye(4), abs=1e-12)


def test_a_polynomial_is_recovered_to_rounding() -> None:
    germ = RNG.uniform(-1.0, 1.0, (120, 2))

    def known(g: np.ndarray) -> np.ndarray:
        return 1.0 + g[:, 0] - 2.0 * g[:, 1] ** 2 + 0.5 * g[:, 0] * g[:, 1] + g[:, 0] ** 4

    fit, elsewhere = polynomial_fit(germ, known(germ)), RNG.uniform(-1.0, 1.0, (40, 2))
    assert fit.basis(elsewhere) @ fit.coefficients[0] == pytest.approx(known(elsewhere), abs=1e-8)
    assert fit.noise < 1e-11


def test_sobol_indices_of_ishigamis_function() -> None:
    germ = space_filling(3, 512)
    x = math.pi * germ
    y = np.sin(x[:, 0]) + 7.0 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    cube = Space((PLANE.variables[0], *(SiteVariable(name, (-1.0,), (1.0,)) for name in ("inclination", "yaw_error"))))
    first, total = model(polynomial_fit(germ, y, degree=10, norm=1.0), cube).shares()
    assert first == pytest.approx([0.3139, 0.4424, 0.0], abs=2e-3)  # Sobol' and Levitan (1999)
    assert total == pytest.approx([0.5576, 0.4424, 0.2437], abs=2e-3)


def test_noise_is_told_from_shape_and_draws_cover_the_truth() -> None:
    germ = RNG.uniform(-1.0, 1.0, (300, 2))
    truth = np.exp(0.5 * germ[:, 0]) + 0.3 * germ[:, 1]
    fit = polynomial_fit(germ, truth + 0.1 * RNG.standard_normal(300))
    assert math.sqrt(fit.noise) == pytest.approx(0.1, rel=0.1)
    values = fit.basis(germ) @ fit.coefficients.T
    error, drawn = values[:, 0] - truth, (values[:, 1:] - values[:, :1]).std()
    assert np.sqrt(np.mean(error**2)) < 0.03
    assert 0.5 < drawn / np.sqrt(np.mean(error**2)) < 2.0


def test_a_gaussian_process_interpolates_data_without_noise() -> None:
    pytest.importorskip("sklearn")
    germ = space_filling(2, 40)
    y = np.sin(2.0 * germ[:, 0]) * germ[:, 1]
    fit = gaussian_fit(germ, y)
    assert fit.basis(germ) @ fit.coefficients[0] == pytest.approx(y, abs=1e-3)  # its least noise
    middle = 0.9 * germ[::-1]
    assert fit.basis(middle) @ fit.coefficients[0] == pytest.approx(np.sin(2 * middle[:, 0]) * middle[:, 1], abs=0.02)


def test_scatter_is_pooled_over_repeated_points() -> None:
    point = np.repeat(np.arange(400), 6)
    y = np.repeat(RNG.uniform(0.0, 5.0, 400), 6) + 0.2 * RNG.standard_normal(2400)
    assert seed_scatter(point, y) == pytest.approx(0.2, rel=0.05)
    assert seed_scatter(np.arange(5), np.arange(5.0)) is None


def runs(n: int = 60, noise: float = 0.05) -> tuple[SurrogateCampaign, SurrogateDesign, np.ndarray]:
    campaign = SurrogateCampaign(
        turbine="nrel5mw",
        variables=("turbulence_intensity",),
        loads={"tower_base_moment_fore_aft": 4.0},
        points=n,
        repeats=10,
        checks=20,
        seeds=4,
    )
    design = surrogate_design(campaign)
    loads = 1e6 * (2.0 + design.values[:, :1]) * (1.0 + 5.0 * design.values[:, 1:2])
    return campaign, design, loads * np.exp(noise * np.random.default_rng(2).standard_normal(loads.shape))


@pytest.mark.parametrize("kind", ["polynomial", "gaussian"])
def test_a_fit_predicts_held_out_points(kind: str) -> None:
    if kind == "gaussian":
        pytest.importorskip("sklearn")
    made = fit_surrogate(*runs(), kind)
    errors = made["tower_base_moment_fore_aft"].errors
    assert errors["r2"] > 0.98 and errors["nrmse"] < 0.05 and abs(errors["bias"]) < 0.02
    assert errors["floor"] == pytest.approx(0.025, rel=0.4)
    assert made["tower_base_moment_fore_aft"].scatter == pytest.approx(0.05, rel=0.3)
    assert made.facts["points"] == 60 and made.facts["checks"] == 20
    found = made(speed=[[8.0], [12.0]], turbulence_intensity=[0.1, 0.15, 0.2])["tower_base_moment_fore_aft"]
    assert found.shape == (2, 3) and found[1, 2] == pytest.approx(14e6 * 2.0, rel=0.06)


def test_designs_have_a_seed_for_each_run() -> None:
    _, design, _ = runs()
    assert len(set(design.seed)) == len(design) == 50 + 10 * 4 + 20 * 4
    assert len(np.unique(design.values[design.point == 3], axis=0)) == 1 and (design.point == 3).sum() == 4
    more = design.extended(np.array([[10.0, 0.1]]))
    assert more.seed[-1] == design.seed.max() + 1 and not more.check[-1] and more.point[-1] == design.point.max() + 1


def test_lifetime_loads_of_closed_form() -> None:
    p = np.array([0.2, 0.3])
    constant = linear(math.log(5.0), 0.0, 0.0, scatter=0.1)["tower"]
    expected = 5.0 * 0.5**0.25 * math.exp(4.0 * 0.1**2 / 2.0)  # of lognormal seeds: E[S^m]^(1/m)
    assert constant.lifetime(p, np.zeros((2, 2))) == pytest.approx(expected, rel=1e-12)
    mild = Sector(weibull_scale=6.0, weibull_shape=1.0, speed=[10.0], intensity=[0.2])
    grows = linear(0.0, 0.02, 0.0)  # exponential distribution: the integral of exp(m b U - U/A)/A
    rate = 4.0 * 0.02 - 1.0 / 6.0
    exact = ((math.exp(25.0 * rate) - math.exp(3.0 * rate)) / (6.0 * rate)) ** 0.25
    (found,) = lifetime_loads(grows, [SiteTable(sectors=(mild,))])["tower"]
    assert found == pytest.approx(exact, rel=1e-4)


def test_sectors_and_yaw_errors_share_the_time() -> None:
    half = {"weibull_scale": 8.0, "speed": [10.0], "intensity": [0.2]}
    two = SiteTable(sectors=(Sector(frequency=0.5, **half), Sector(frequency=0.5, shear_exponent=0.1, **half)))
    full = Surrogate("made", SPACE, {}, {})
    p, x = conditions_of(full, two)
    one, _ = conditions_of(full, SiteTable(sectors=(Sector(**half),)))
    assert p.sum() == pytest.approx(one.sum()) == pytest.approx(math.exp(-((3 / 8) ** 2)) - math.exp(-((25 / 8) ** 2)))
    assert p[x[:, 5] == 0.0].sum() == pytest.approx(0.5 * p.sum())
    assert set(np.degrees(x[:, 5]).round(6)) == {-8.0, 0.0, 8.0}
    with pytest.raises(InputError, match="sum to 1"):
        SiteTable(sectors=(Sector(frequency=0.5, **half),))


def test_the_verdict_of_a_site() -> None:
    surrogate, design = linear(10.0, 0.1, 3.0, draws=0.001), class_table("IB")

    def site(intensity: float) -> SiteTable:
        (sector,) = design.sectors
        return SiteTable(sectors=(sector.replace(intensity=intensity * sector.intensity),))

    same = site_suitability(surrogate, site(1.0), design).margins[0]
    assert same.ratio == pytest.approx(1.0) and same.low <= 1.0 <= same.high
    calm, rough = (site_suitability(surrogate, site(f), design) for f in (0.9, 1.1))
    assert (calm.verdict, rough.verdict) == ("suitable", "not suitable")
    assert calm.margins[0].ratio < 1.0 < rough.margins[0].ratio and not calm.outside
    wide = linear(10.0, 0.1, 3.0, draws=0.5)
    assert site_suitability(wide, site(0.97), design).verdict == "undecided"
    beyond = site_suitability(surrogate, site(0.2), design)
    assert beyond.outside["turbulence_intensity"] > 0.5 and beyond.verdict == "undecided"
    assert site_suitability(surrogate, site(1.0), class_table("IIIC")).verdict == "not suitable"


def test_neighbours_raise_loads_by_the_effective_turbulence_of_their_slope() -> None:
    sector = Sector(weibull_scale=9.0, speed=[4.0, 25.0], intensity=[0.1, 0.1], thrust_coefficient=[0.8, 0.8])
    plain, waked = (SiteTable(sectors=(sector,), neighbours=n) for n in ((), (5.0, 7.0)))
    full = Surrogate("made", SPACE, {}, {})
    column = SPACE.names.index("turbulence_intensity")
    for slope in (4.0, 10.0):
        _, x = conditions_of(full, waked, slope)
        speed = x[10, 0]
        sigma = [math.hypot(speed / (1.5 + 0.8 * d / math.sqrt(0.8)), 0.1 * speed) for d in (5.0, 7.0)]
        mean = 0.88 * (0.1 * speed) ** slope + 0.06 * sum(s**slope for s in sigma)
        assert x[10, column] == pytest.approx(mean ** (1.0 / slope) / speed)
    # without thrust coefficients 7 m/s over the speed
    usual, one = (
        sector.replace(thrust_coefficient=c).effective(np.array([7.0]), (5.0,), 10.0) for c in (None, [1.0, 1.0])
    )
    assert usual == pytest.approx(one)
    mild, steep = (linear(0.0, 0.02, 3.0, slope=m) for m in (4.0, 10.0))
    ratios = [np.divide(*lifetime_loads(each, [waked, plain])["tower"]) for each in (mild, steep)]
    assert 1.05 < ratios[0] < ratios[1]
    with pytest.raises(InputError, match="2 rotor diameters or more"):
        SiteTable(sectors=(sector,), neighbours=(1.0,))
    with pytest.raises(InputError, match="at most 8"):
        SiteTable(sectors=(sector,), neighbours=(5.0,) * 9)


def test_further_points_are_where_damage_is_uncertain() -> None:
    surrogate = linear(0.0, 0.0, 0.0)
    own = surrogate.loads["tower"]
    rows = own.coefficients + np.array([[0.0], [1.0], [-1.0]]) * [0.0, 1.0, 0.0]  # uncertain at the ends of the speed
    unsure = replace(surrogate, loads={"tower": replace(own, coefficients=rows)})
    flat: Callable[[np.ndarray], np.ndarray] = np.ones_like
    speed = further_points(unsure, 40, flat)[:, 0]
    assert np.abs(speed - 14.0).mean() > 6.3  # 5.5 if they were anywhere
    seldom = further_points(unsure, 40, lambda v: np.exp(-v / 2.0))[:, 0]
    assert seldom.mean() < 6.0
    assert not np.array_equal(speed, further_points(unsure, 40, flat, seed=2)[:, 0])


def judged(r2: float, nrmse: float = 0.3, floor: float = 0.02) -> Surrogate:
    """A surrogate with given errors at held-out points."""
    made = linear(10.0, 0.1, 3.0, draws=0.001)
    errors = {"r2": r2, "nrmse": nrmse, "floor": floor, "bias": 0.0}
    return replace(made, loads={"tower": replace(made["tower"], errors=errors)}, facts={"points": 24})


def test_a_surrogate_that_does_not_predict_is_not_usable(tmp_path: Path) -> None:
    """R2 of -149, with 24 points for 20 terms, was followed by "next: evaluate"."""
    bad = judged(-149.0, 2.4)
    assert not bad.usable and bad["tower"].verdict == "not usable"
    assert bad.verdict.startswith(
        "not usable: tower: R2 -149, NRMSE 240 % at held-out points, with 24 points for 3 terms"
    )
    assert "more points" in bad.verdict and "fewer terms" in bad.verdict and "not usable" in repr(bad)
    assert not judged(0.49).usable and not judged(math.nan).usable and judged(0.5).usable
    assert judged(-0.3, 0.029, 0.02).usable  # a load that hardly varies: within the scatter of the simulated means
    assert not judged(-0.3, 0.031, 0.02).usable
    assert linear(1.0, 0.0, 0.0).usable and linear(1.0, 0.0, 0.0).verdict.startswith("not validated")
    assert judged(0.99).verdict == "usable"
    with pytest.warns(UserWarning, match="not usable: tower: R2 -149"):
        load_surrogate(write_surrogate(bad, tmp_path / "bad.json"))
    load_surrogate(write_surrogate(judged(0.9), tmp_path / "good.json"))


def test_errors_stand_beside_every_value() -> None:
    bad, design = judged(-149.0, 2.4), class_table("IB")
    head, (row,) = value_rows(bad, bad(speed=10.0, turbulence_intensity=0.2))
    shown = dict(zip(head, row, strict=True))
    assert (shown["R2"], shown["NRMSE %"], shown["verdict"]) == ("-149.0", "240.0", "not usable")
    calm = SiteTable(sectors=(design.sectors[0].replace(intensity=0.9 * design.sectors[0].intensity),))
    assert site_suitability(judged(0.9), calm, design).verdict == "suitable"
    found = site_suitability(bad, calm, design)
    assert found.verdict == "undecided"
    head, (row,) = suitability_rows(found)
    assert row[head.index("R2")] == "-149.0" and row[head.index("NRMSE %")] == "240.0" and row[-1] == "undecided"
    head, (row,) = fit_rows(bad)
    assert head[-1] == "verdict" and row[-1] == "not usable"


def test_further_points_fill_the_space_where_the_fit_is_not_usable() -> None:
    def seldom(speed: np.ndarray) -> np.ndarray:
        return np.exp(-speed)

    assert further_points(judged(0.9), 64, seldom)[:, 0].mean() < 8.0
    germ = PLANE.germ(further_points(judged(-149.0), 64, seldom))
    assert np.abs(germ.mean(axis=0)).max() < 0.05


def test_a_lower_degree_has_fewer_terms() -> None:
    terms = [fit_surrogate(*runs(), degree=p)["tower_base_moment_fore_aft"].coefficients.shape[1] for p in (1, 12)]
    assert terms[0] <= 3 < terms[1]
    with pytest.raises(InputError, match="degree 0: expected 1 to 12"):
        fit_surrogate(*runs(), degree=0)


def test_what_is_outside_is_an_error_or_clipped_or_nan() -> None:
    surrogate = linear(1.0, 0.05, 2.0)
    edge = surrogate(speed=25.0, turbulence_intensity=0.2)["tower"]
    with pytest.raises(InputError, match=r"speed 26 m/s is outside 3 to 25; 1 of 2 points are outside"):
        surrogate(speed=[10.0, 26.0], turbulence_intensity=0.2)
    with pytest.warns(UserWarning, match="nearest bound"):
        assert surrogate(speed=26.0, turbulence_intensity=0.2, outside="clip")["tower"] == edge
    found = surrogate(speed=[10.0, 26.0], turbulence_intensity=0.2, outside="nan")["tower"]
    assert np.isfinite(found).tolist() == [True, False]
    with pytest.raises(InputError, match="speed nan"):
        surrogate(speed=math.nan, turbulence_intensity=0.2)


@pytest.mark.parametrize(
    ("inputs", "words"),
    [
        ({"speed": 10.0}, r"missing turbulence_intensity \[-\]"),
        ({"sped": 10.0}, "no variable 'sped': did you mean 'speed'"),
        ({"speed": [1.0, 2.0], "turbulence_intensity": [0.1, 0.2, 0.3]}, "shape"),
        ({"speed": 10.0, "turbulence_intensity": 0.1, "outside": "ignore"}, "error, clip or nan"),
    ],
)
def test_wrong_inputs_are_told(inputs: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        linear(1.0, 0.0, 0.0)(**inputs)  # type: ignore[arg-type]


def test_what_a_caller_leaves_out_is_neutral() -> None:
    degrees = np.eye(6, dtype=int)
    own = LoadModel("x", "N", 4.0, SPACE, Polynomials(degrees), np.ones((1, 6)), 0.0, {})
    surrogate = Surrogate("made", SPACE, {"x": own}, {})
    given = {"shear_exponent": 0.2, "air_density": 1.225, "inclination": 0.0, "yaw_error": 0.0}
    least = {"speed": 10.0, "turbulence_intensity": 0.1}
    assert surrogate(**least)["x"] == surrogate(**least, **given)["x"]
    for name in given:
        assert surrogate(**least, **{name: 1.1 if name == "air_density" else 0.1})["x"] != surrogate(**least)["x"]


@pytest.mark.parametrize("kind", ["polynomial", "gaussian"])
def test_a_file_gives_the_same_function_without_scikit_learn(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if kind == "gaussian":
        pytest.importorskip("sklearn")
    made = fit_surrogate(*runs(), kind)
    path = write_surrogate(made, tmp_path / "a.json")
    for module in ("sklearn", "scipy", "pandas", "pyarrow"):
        monkeypatch.setitem(sys.modules, module, None)
    read = load_surrogate(path)
    at = {"speed": np.linspace(4.0, 24.0, 9), "turbulence_intensity": 0.12}
    assert read(**at)["tower_base_moment_fore_aft"] == pytest.approx(made(**at)["tower_base_moment_fore_aft"], rel=1e-6)
    assert read.space == made.space and read.inputs == {"speed": "m/s", "turbulence_intensity": "-"}
    assert dict(read.facts) == dict(made.facts) and read["tower_base_moment_fore_aft"].errors
    assert write_surrogate(read, tmp_path / "b.json").read_bytes() == path.read_bytes()


def test_a_surrogate_of_another_turbine_is_refused(tmp_path: Path) -> None:
    path = write_surrogate(fit_surrogate(*runs()), tmp_path / "a.json")
    turbine = load_turbine("nrel5mw")
    assert load_surrogate(path, turbine).turbine == "nrel5mw"
    with pytest.raises(InputError, match=r"fitted to nrel5mw, whose data differ from those of heavy"):
        load_surrogate(path, turbine.replace(**{"name": "heavy", "hub.mass": 1e5}))


def test_a_surrogate_has_the_name_of_a_turbine_not_its_path(tmp_path: Path) -> None:
    campaign, design, loads = runs()
    write_turbine(load_turbine("nrel5mw").replace(name="heavy"), tmp_path / "of_file.yaml")
    own = campaign.replace(turbine=str(tmp_path / "of_file.yaml"))
    assert fit_surrogate(own, design, loads).turbine == "heavy"


def test_a_campaign_is_written_whole_or_not_at_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    campaign, design, _ = runs()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("meltemi.loads.surrogate.campaign.write_record", full)
    with pytest.raises(InputError, match="surrogate.yaml: cannot be written .No space left"):
        write_surrogate_campaign(campaign, design, tmp_path)
    assert list(tmp_path.iterdir()) == []


def test_models_have_what_pywake_asks_for() -> None:
    (each,) = linear(1.0, 0.05, 2.0).loads.values()
    assert (each.output_names[0], each.metadata["wohler_exponent"]) == ("tower", 4.0)  # PyWake 2.6
    rows = np.array([[10.0, 0.1], [12.0, 0.2]])
    assert each.predict_output(rows) == pytest.approx(np.exp(1.0 + 0.05 * rows[:, 0] + 2.0 * rows[:, 1]))
    with pytest.raises(InputError, match=r"rows of speed, turbulence_intensity, found an array of the shape \(1, 3\)"):
        each.predict_output([1.0, 2.0, 3.0])
    with pytest.warns(UserWarning, match="nearest bound"):
        assert each.predict_output([26.0, 0.1]) == pytest.approx(each.predict_output([25.0, 0.1]))


def test_damaged_files_are_refused(tmp_path: Path) -> None:
    path = write_surrogate(linear(1.0, 0.05, 2.0), tmp_path / "a.json")
    data = json.loads(path.read_text())
    cases = {"no load surrogate": {}, "version 7": data | {"version": 7}, "damaged": data | {"variables": 3}}
    cases["coefficients of tower"] = data | {"loads": [data["loads"][0] | {"coefficients": [[1.0]]}]}
    cases["OverflowError"] = data | {"loads": [data["loads"][0] | {"coefficients": [[10**400] * 3]}]}
    first = data["variables"][1] | {"upper": data["variables"][1]["lower"]}
    cases["ValueError: bounds"] = data | {"variables": [data["variables"][0], first, *data["variables"][2:]]}
    for words, content in cases.items():
        path.write_text(json.dumps(content | {"checksum": _checksum(content)}))
        with pytest.raises(InputError, match=words) as error:
            load_surrogate(path)
        assert "\n" not in str(error.value)
    path.write_text(json.dumps(data | {"turbine": "other"}))
    with pytest.raises(InputError, match="damaged or changed: its checksum does not match"):
        load_surrogate(path)
    path.write_text(json.dumps(data)[:-40])
    with pytest.raises(InputError, match="damaged"):
        load_surrogate(path)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"variables": ("spede",)}, "no site variable 'spede': did you mean 'speed'"),
        ({"bounds": {"air_density": (1.3, 1.0)}}, "must ascend"),
        ({"variables": ("speed",), "bounds": {"air_density": (1.0, 1.3)}}, "not among the variables speed"),
        ({"loads": {"tower_base": 4.0}}, "no load 'tower_base': did you mean"),
        ({"variables": ("power_reference",)}, "needs controller"),
        ({"points": 4, "repeats": 5}, "repeats: 5 of 4 points"),
        ({"loads": {"rotor_torque": 0.0}}, "positive slope"),
        ({"bounds": {"shear_exponent": (-2.0, 0.5)}}, "runs of the campaign: wind"),
        ({"turbulence": {"pionts": 15}}, "did you mean 'points'"),
    ],
)
def test_wrong_campaigns_are_told(settings: dict[str, object], words: str) -> None:
    with pytest.raises(InputError, match=words):
        surrogate_design(SurrogateCampaign(turbine="nrel5mw", **settings))


def test_too_few_points_are_told() -> None:
    campaign, design, loads = runs()
    few = np.isin(design.point, [0, 1, 2])
    some = SurrogateDesign(design.space, *(getattr(design, name)[few] for name in ("point", "seed", "check", "values")))
    with pytest.raises(InputError, match="3 points are too few for a fit: expected 6"):
        fit_surrogate(campaign, some, loads[few])
    with pytest.raises(InputError, match="kind"):
        fit_surrogate(campaign, design, loads, "kriging")
