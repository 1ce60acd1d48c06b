"""A load surrogate as a function, and its file: NumPy alone evaluates it.

The logarithm of each equivalent load is linear in functions of the germ: Legendre polynomials, or the kernel of a
Gaussian process. Equations LS-4 to LS-9 and LS-15 of ``docs/theory/surrogate.md``.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal
from warnings import warn

import numpy as np
from numpy.typing import ArrayLike, NDArray

import meltemi
from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.files import text_of, write_text
from meltemi.loads.surrogate.space import UNITS, SiteVariable, Space
from meltemi.postprocess.inputs import floats

if TYPE_CHECKING:
    from meltemi.turbine.power_turbine import AnyTurbine

Float = NDArray[np.float64]
FORMAT, VERSION = "meltemi load surrogate", 2
NEUTRAL = {"shear_exponent": 0.2, "air_density": 1.225, "inclination": 0.0, "yaw_error": 0.0}
"""Values of variables that a caller leaves out."""
SLACK = 1e-9
"""Amount by which rounding may take germs beyond their bounds."""
LARGEST_LOGARITHM = 100.0
"""Largest logarithm of a load [N, N m]; those of the largest turbines are below 21."""
LEAST_R2, WITHIN = 0.5, 1.5
"""Smallest R^2 at held-out points of a usable load, or largest NRMSE over that of a perfect surrogate, since the
scatter of the simulated means hides the rest (LS-15)."""
BLOCK = 1024
"""Number of points that are evaluated together, for the cache of the processor."""
Outside = Literal["error", "clip", "nan"]


@dataclass(frozen=True)
class Polynomials:
    """Products of orthonormal Legendre polynomials.

    Attributes:
      degrees: (P, d) degree of each factor.
    """

    degrees: NDArray[np.int64]

    def __call__(self, germ: Float) -> Float:
        """Values (n, P) of the products at germs (n, d)."""
        return legendre_products(germ, self.degrees)


@dataclass(frozen=True)
class Kernels:
    """Squared exponentials about the points of the fit, and a constant.

    Attributes:
      centres: (N, d) germs.
      lengths: (d,) length scales.
    """

    centres: Float
    lengths: Float

    def __call__(self, germ: Float) -> Float:
        """Values (n, N + 1) of the kernels at germs (n, d)."""
        x, c = germ / self.lengths, self.centres / self.lengths
        square = np.sum(x**2, 1)[:, None] + np.sum(c**2, 1) - 2.0 * x @ c.T
        return np.column_stack([np.exp(-0.5 * np.maximum(square, 0.0)), np.ones(len(x))])


def legendre_products(germ: Float, degrees: NDArray[np.int64]) -> Float:
    """Products (n, P) of Legendre polynomials of germs (n, d), orthonormal for uniform germs (LS-5)."""
    products = np.ones((len(degrees), len(germ)))
    norm = np.sqrt(2.0 * np.arange(degrees.max(initial=0) + 1) + 1.0)
    for x, orders in zip(germ.T, degrees.T, strict=True):
        if top := int(orders.max(initial=0)):
            values = np.polynomial.legendre.legvander(x, top).T * norm[: top + 1, None]
            for k in range(1, top + 1):
                products[orders == k] *= values[k]
    return products.T


@dataclass(frozen=True)
class LoadModel:
    """Model of one equivalent load, with the attributes that PyWake asks for.

    Attributes:
      name, unit: name and unit of the equivalent load at 1 Hz, a range.
      slope: slope m of the S-N curve.
      space: space of the variables.
      basis: functions of the germ.
      coefficients: (1 + B, P) coefficients of the logarithm of the load, and draws that show their uncertainty.
      scatter: standard deviation of the logarithm over seeds.
      errors: measures of the validation.
    """

    name: str
    unit: str
    slope: float
    space: Space
    basis: Polynomials | Kernels
    coefficients: Float
    scatter: float
    errors: Mapping[str, float]

    @property
    def input_names(self) -> tuple[str, ...]:
        return self.space.names

    @property
    def output_names(self) -> tuple[str, ...]:
        return (self.name,)

    @property
    def metadata(self) -> dict[str, float]:
        return {"wohler_exponent": self.slope}

    @property
    def verdict(self) -> Literal["usable", "not usable", "not validated"]:
        """Whether the load may be used, by its errors at held-out points (LS-15)."""
        if "r2" not in self.errors:
            return "not validated"
        e = self.errors
        return "usable" if e["r2"] >= LEAST_R2 or e["nrmse"] <= WITHIN * e["floor"] else "not usable"

    def logarithm(self, germ: Float, fits: int = 1) -> Float:
        """Expected logarithm (n, fits) of the load, the first column that of the fit."""
        blocks = np.array_split(germ, len(germ) // BLOCK + 1)
        return np.concatenate([self.basis(block) @ self.coefficients[:fits].T for block in blocks])

    def predict_output(self, x: ArrayLike, outside: Outside = "clip") -> Float:
        """Mean load (n,) over seeds at rows (n, d) of the variables in their order.

        Args:
          x: rows, in SI units.
          outside: action outside the bounds: "error", "clip" (the nearest bound, with a warning) or "nan".
        """
        return self.mean(inside(self.space, x, outside))

    def mean(self, germ: Float) -> Float:
        """Mean load (n,) over seeds at germs.

        Raises:
          InputError: the load is infinite, as of a damaged surrogate.
        """
        return self._finite(self.logarithm(germ)[:, 0] + 0.5 * self.scatter**2)

    def _finite(self, log: Float) -> Float:
        if np.any(log > LARGEST_LOGARITHM):
            raise InputError(f"{self.name}: its load is infinite; is the surrogate damaged?")
        return np.exp(log)

    def lifetime(self, probability: Float, germ: Float, fits: int | None = None) -> Float:
        """Equivalent load at 1 Hz (fits,) over conditions of given probability (LS-8)."""
        m, log = self.slope, self.logarithm(germ, len(self.coefficients) if fits is None else fits)
        top = log.max(axis=0)
        damage = np.sum(probability[:, None] * np.exp(m * (log - top)), axis=0)
        with np.errstate(divide="ignore"):  # no time in these conditions: no load
            return self._finite(top + 0.5 * m * self.scatter**2 + np.log(damage) / m)

    def shares(self) -> tuple[Float, Float]:
        """First-order and total Sobol indices (d,) of the logarithm (LS-9).

        Raises:
          InputError: the model is no polynomial chaos expansion.
        """
        if not isinstance(self.basis, Polynomials):
            raise InputError("Sobol indices follow from the polynomial form; fit with kind 'polynomial'")
        degrees, square = self.basis.degrees > 0, self.coefficients[0] ** 2
        varies, alone = degrees.any(axis=1), degrees.sum(axis=1) == 1
        whole = max(float(square[varies].sum()), 1e-300)
        return (square * alone) @ degrees / whole, square @ degrees / whole


def inside(space: Space, x: ArrayLike, outside: Outside = "error") -> Float:
    """Germs (n, d) of rows of variables; values outside the bounds are an error, clipped with a warning, or NaN.

    Raises:
      InputError: a value is outside, or the rows have another number of variables.
    """
    if outside not in ("error", "clip", "nan"):
        raise InputError(f"outside: expected error, clip or nan, found {outside!r}")
    points = np.atleast_2d(np.asarray(x, dtype=float))
    if points.ndim != 2 or points.shape[1] != len(space.variables):
        raise InputError(f"expected rows of {', '.join(space.names)}, found an array of the shape {points.shape}")
    germ = space.germ(points)
    beyond = ~(np.abs(germ) <= 1.0 + SLACK)  # not a number, too
    if beyond.any() and outside == "nan":
        germ[beyond.any(axis=1)] = np.nan
    elif beyond.any():
        row, i = np.argwhere(beyond)[0]
        name, low, high = space.names[i], *(bound[0, i] for bound in space.bounds(points[row, :1]))
        at = f" at {points[row, 0]:g} m/s" if i else ""
        words = f"{name} {points[row, i]:g} {UNITS[name]} is outside {low:.4g} to {high:.4g}{at}"
        words += f"; {beyond.any(axis=1).sum()} of {len(germ)} points are outside the surrogate"
        if outside == "error" or not np.isfinite(points).all():
            raise InputError(words)
        warn(f"{words}: they take the nearest bound", stacklevel=3)
    return np.clip(germ, -1.0, 1.0)


@dataclass(frozen=True)
class Surrogate:
    """Equivalent loads of a turbine as a function of the site variables.

    Attributes:
      turbine: name of the turbine.
      space: variables with bounds.
      loads: models by name.
      facts: facts of the fit: kind, numbers of points and runs, duration, ``turbine_hash``.
    """

    turbine: str
    space: Space
    loads: Mapping[str, LoadModel]
    facts: Mapping[str, Any]

    def __repr__(self) -> str:
        known = f"{self.turbine}: {', '.join(self.loads)} over {', '.join(self.space.names)}"
        return f"<Surrogate of {known}; {self.verdict}>"

    @property
    def usable(self) -> bool:
        """Whether no load is known to be not usable."""
        return all(each.verdict != "not usable" for each in self.loads.values())

    @property
    def verdict(self) -> str:
        """Whether its loads may be used: ``usable``, or the loads that are not, with reason and remedy."""
        bad = [each for each in self.loads.values() if each.verdict == "not usable"]
        if not bad:
            checked = all(each.verdict == "usable" for each in self.loads.values())
            return "usable" if checked else "not validated: it has no held-out points; design it with --checks"
        each = min(bad, key=lambda load: load.errors["r2"])
        errors = f"R2 {each.errors['r2']:.3g}, NRMSE {100.0 * each.errors['nrmse']:.3g} %"
        others = f" and {len(bad) - 1} other loads" * (len(bad) > 1)
        terms = f" for {each.coefficients.shape[1]} terms" * isinstance(each.basis, Polynomials)
        points = f"{self.facts.get('points', 'too few')} points{terms}"
        return (
            f"not usable: {each.name}{others}: {errors} at held-out points, with {points}; take more points (refine), "
            "or fewer terms (fit --degree, or fewer variables)"
        )

    @property
    def inputs(self) -> dict[str, str]:
        """Units of the variables by name."""
        return {name: UNITS[name] for name in self.space.names}

    def __call__(self, *, outside: Outside = "error", **inputs: ArrayLike) -> dict[str, Float]:
        """Equivalent loads at 1 Hz, ranges in N or N m, the mean over seeds.

        Args:
          outside: action outside the bounds: "error", "clip" (the nearest bound, with a warning) or "nan".
          inputs: numbers or arrays of compatible shapes, in SI units. ``shear_exponent`` is 0.2, ``air_density``
            1.225 kg/m^3, angles zero and ``power_reference`` rated power unless given.

        Returns:
          Arrays of the common shape, by load.

        Raises:
          InputError: a variable is missing, unknown or outside the bounds, or shapes are not compatible.
        """
        x, shape = self._rows(inputs)
        germ = inside(self.space, x, outside)
        return {name: each.mean(germ).reshape(shape) for name, each in self.loads.items()}

    def _rows(self, inputs: Mapping[str, ArrayLike]) -> tuple[Float, tuple[int, ...]]:
        names = self.space.names
        for name in inputs:
            if name not in names:
                raise InputError(f"surrogate of {self.turbine}: no variable {name!r}: {did_you_mean(name, names)}")
        rated = {v.name: v.upper[0] for v in self.space.variables if v.name == "power_reference"}
        given = {**NEUTRAL, **rated, **inputs}
        if missing := [f"{name} [{UNITS[name]}]" for name in names if name not in given]:
            raise InputError(f"surrogate of {self.turbine}: missing {', '.join(missing)}")
        try:
            columns = np.broadcast_arrays(*(floats(given[name], name) for name in names))
        except ValueError as error:
            raise InputError(f"surrogate of {self.turbine}: {error}") from None
        return np.column_stack([column.ravel() for column in columns]), columns[0].shape

    def __getitem__(self, name: str) -> LoadModel:
        if name not in self.loads:
            raise InputError(f"surrogate of {self.turbine}: no load {name!r}: {did_you_mean(name, self.loads)}")
        return self.loads[name]


def write_surrogate(surrogate: Surrogate, path: str | Path) -> Path:
    """Write a surrogate as JSON.

    Raises:
      InputError: the file cannot be written.
    """
    loads = []
    for each in surrogate.loads.values():
        b = each.basis
        basis = {"degrees": b.degrees.tolist()} if isinstance(b, Polynomials) else {"lengths": b.lengths.tolist()}
        rows = [[float(f"{c:.9g}") for c in row] for row in each.coefficients]
        facts = {"name": each.name, "unit": each.unit, "slope": each.slope, "scatter": each.scatter}
        loads.append(facts | {"errors": dict(each.errors), **basis, "coefficients": rows})
    centres = next((e.basis.centres.tolist() for e in surrogate.loads.values() if isinstance(e.basis, Kernels)), None)
    variables = [asdict(v) | {"unit": UNITS[v.name]} for v in surrogate.space.variables]
    for variable in variables:
        variable |= {k: None for k in ("least", "most") if abs(variable[k]) == inf}
    content = {"format": FORMAT, "version": VERSION, "meltemi": meltemi.__version__, "turbine": surrogate.turbine}
    content |= {"variables": variables, "facts": dict(surrogate.facts), "centres": centres, "loads": loads}
    write_text(Path(path), json.dumps(content | {"checksum": _checksum(content)}, separators=(",", ":")) + "\n")
    return Path(path)


def _checksum(content: Mapping[str, Any]) -> str:
    """Hash of the content of a file without its checksum."""
    checked = {name: value for name, value in content.items() if name != "checksum"}
    return hashlib.sha256(json.dumps(checked, sort_keys=True).encode()).hexdigest()


def load_surrogate(path: str | Path, turbine: AnyTurbine | None = None) -> Surrogate:
    """Read a surrogate as a function of the site variables; needs NumPy only.

    A surrogate that is not usable gives a warning.

    Args:
      path: file of the surrogate.
      turbine: turbine of the loads; by default that of the file.

    Raises:
      InputError: the file cannot be read, is damaged or no load surrogate, or is that of another turbine.
    """
    surrogate = _read(path)
    if not surrogate.usable:
        warn(f"{path}: {surrogate.verdict}", stacklevel=2)
    if turbine is not None and surrogate.facts.get("turbine_hash") != turbine.content_hash():
        raise InputError(
            f"{path}: it was fitted to {surrogate.turbine}, whose data differ from those of {turbine.name}; "
            "design a surrogate of this turbine: meltemi surrogate design TURBINE"
        )
    return surrogate


def _read(path: str | Path) -> Surrogate:
    text = text_of(Path(path))
    try:
        data = json.loads(text)
        if not isinstance(data, dict) or data.get("format") != FORMAT:
            raise InputError(f"{path}: no load surrogate; 'meltemi surrogate fit FOLDER' writes one")
        if data["version"] != VERSION:
            raise InputError(
                f"{path}: version {data['version']!r} of the format; this meltemi reads {VERSION}: "
                "'meltemi surrogate fit FOLDER' writes it again"
            )
        if data.get("checksum") != _checksum(data):
            raise InputError(f"{path}: damaged or changed: its checksum does not match its content")
        space = Space(tuple(map(_variable, data["variables"])))
        with np.errstate(all="ignore"):
            low, high = space.bounds(np.linspace(*space.ends, 9))
        if not np.all(low < high):
            raise ValueError("bounds")
        loads = {}
        for each in data["loads"]:
            basis: Polynomials | Kernels
            if "degrees" in each:
                basis = Polynomials(np.array(each["degrees"], dtype=np.int64))
            else:
                basis = Kernels(np.array(data["centres"], dtype=float), np.array(each["lengths"], dtype=float))
            described = (each["name"], each["unit"], float(each["slope"]), space, basis)
            rows = np.array(each["coefficients"], dtype=float)
            if rows.shape[1] != basis(np.zeros((1, len(space.variables)))).shape[1] or not np.isfinite(rows).all():
                raise ValueError(f"coefficients of {each['name']}")
            loads[each["name"]] = LoadModel(*described, rows, float(each["scatter"]), each["errors"])
        return Surrogate(data["turbine"], space, loads, data["facts"])
    except (ValueError, LookupError, TypeError, AttributeError, OverflowError, RecursionError) as error:
        raise InputError(f"{path}: damaged, or no load surrogate ({type(error).__name__}: {error})") from None


def _variable(content: Mapping[str, Any]) -> SiteVariable:
    """A variable of a file, in which none is an infinite limit."""
    lower, upper = (tuple(map(float, content[name])) for name in ("lower", "upper"))
    least, most = (
        limit if content[name] is None else float(content[name]) for name, limit in (("least", -inf), ("most", inf))
    )
    return SiteVariable(str(content["name"]), lower, upper, least, most)
