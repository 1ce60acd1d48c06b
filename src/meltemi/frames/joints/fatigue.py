"""Damage of the welds of joints over a lifetime, and the largest utilisations of members (F-58 to F-69)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from meltemi.core.errors import InputError, did_you_mean
from meltemi.core.shown import Brief
from meltemi.frames.definition import Frame
from meltemi.frames.joints.geometry import Joint, tubular_joints
from meltemi.frames.joints.hot_spots import SIDES, Loads, hot_spots
from meltemi.frames.joints.scf import Factors, factors, outside, parameters_of
from meltemi.frames.joints.settings import JointSettings
from meltemi.frames.joints.utilisation import CLAUSES, member_checks
from meltemi.frames.loads import PLACES
from meltemi.frames.water import sections_of
from meltemi.postprocess.cycles import Cycles, rainflow_cycles, sum_cycles
from meltemi.postprocess.sn import Curve, Environment, sn_curve, spectral_damage
from meltemi.postprocess.spectra import power_spectrum

if TYPE_CHECKING:
    import pandas as pd

Float = NDArray[np.float64]

GRAVITY = 9.80665
COLUMNS = "joint brace end side position curve damage life DFF utilisation outside".split()


class Weld(NamedTuple):
    """Welds of a joint: stress concentration factors and parameters outside their ranges by brace, and S-N curve."""

    joint: Joint
    factors: list[Factors]
    outside: list[list[str]]
    curve: Curve
    environment: Environment


class LoadCase(NamedTuple):
    """Section loads of a simulation.

    Attributes:
      name: of the case.
      loads: (T, 6) [N, N m] by member and place.
      duration: [s] of the series.
      hours: [h] of the lifetime that it stands for.
    """

    name: str
    loads: Loads
    duration: float
    hours: float


@dataclass(frozen=True, repr=False)
class JointFatigue(Brief):
    """Fatigue of the joints of a frame.

    Attributes:
      table: a row for each point: joint, brace, end, side, position [deg], curve, damage (of the lifetime, without the
        design fatigue factor DFF), life [years] to damage 1, DFF, utilisation (damage times DFF), outside (parameters
        outside the ranges of the equations).
      shares: share of each case in the damage of the worst point of each joint; index joint, a column a case.
      markov: cycles of the lifetime at the worst point of each joint [N/m^2].
    """

    table: pd.DataFrame
    shares: pd.DataFrame
    markov: dict[str, Cycles]

    @property
    def worst(self) -> pd.DataFrame:
        """The row of each joint with the largest damage, largest first."""
        rows = self.table.loc[self.table.groupby("joint", sort=False)["damage"].idxmax()]
        return rows.sort_values("damage", ascending=False)


def environment_at(height: float, settings: JointSettings) -> Environment:
    """Environment of a joint at a height [m] above mean sea level."""
    if settings.environment != "height":
        return settings.environment
    low, high = settings.splash_zone
    return "cathodic" if height < low else "free" if height <= high else "air"


def welds_of(frame: Frame, settings: JointSettings) -> list[Weld]:
    """Welds of all joints of a frame.

    Raises:
      InputError: there is no such S-N curve, no joint of tubes, or no joint of a can.
    """
    welds = []
    for joint in tubular_joints(frame, settings.cans):
        given, around = parameters_of(joint, settings.alpha), environment_at(joint.height, settings)
        f = [factors(p, settings.fixity, settings.chord_bending) for p in given]
        curve = sn_curve(settings.curve, around, settings.edition)
        welds.append(Weld(joint, f, [outside(p) for p in given], curve, around))
    if not welds:
        raise InputError("joints: the frame has no joint at which a tube meets a chord")
    return welds


def stresses_of(weld: Weld, loads: Loads, settings: JointSettings) -> Float:
    """Hot-spot stresses (n, 2, 8, T) [N/m^2] of a joint's welds."""
    bending, axial = settings.chord_bending == "frame", settings.chord_axial
    return hot_spots(weld.joint, weld.factors, loads, settings.classification, bending=bending, axial=axial)


def case_damage(weld: Weld, stresses: Float, duration: float, settings: JointSettings) -> Float:
    """Damage (n, 2, 8) of a joint's welds by hot-spot stresses (n, 2, 8, T) of a duration [s]."""
    damage = np.zeros(stresses.shape[:3])
    for at in np.ndindex(damage.shape):
        x, thickness = stresses[at], (weld.joint.thickness, weld.joint.braces[at[0]].tube.thickness)[at[1]]
        if settings.counting == "rainflow":
            damage[at] = weld.curve.damage(rainflow_cycles(x), thickness)
        else:
            s = power_spectrum(x, dt=duration / (len(x) - 1))
            damage[at] = spectral_damage(s.frequency, s.density, duration, weld.curve, thickness)
    return damage


def joint_fatigue(
    frame: Frame, cases: Sequence[LoadCase], settings: JointSettings | None = None, years: float = 20.0
) -> JointFatigue:
    """Fatigue of the joints of a frame over a lifetime of ``years``.

    Raises:
      InputError: there are no cases, loads are missing, or there is no such S-N curve.
    """
    s = settings or JointSettings()
    if not cases:
        raise InputError("joints: no cases with section loads")
    welds, repeated = welds_of(frame, s), [case.hours * 3600.0 / case.duration for case in cases]
    damage, markov = {}, {}
    for weld in welds:
        single = [case_damage(weld, stresses_of(weld, case.loads, s), case.duration, s) for case in cases]
        damage[weld.joint.name] = of_cases = np.array(repeated)[:, None, None, None] * single
        worst = np.unravel_index(int(of_cases.sum(axis=0).argmax()), of_cases.shape[1:])
        parts = (rainflow_cycles(stresses_of(weld, case.loads, s)[worst]) for case in cases)
        markov[weld.joint.name] = sum_cycles(parts, repeated)
    table, shares = fatigue_tables(welds, damage, [case.name for case in cases], s, years)
    return JointFatigue(table, shares, markov)


def fatigue_tables(
    welds: Iterable[Weld], damage: Mapping[str, Float], names: Sequence[str], settings: JointSettings, years: float
) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Tables of points and of shares from the damage (cases, n, 2, 8) of each joint."""
    import pandas as pd

    rows, shares, dff = [], {}, settings.design_fatigue_factor
    for weld in welds:
        name, curve, of_cases = weld.joint.name, f"{settings.curve}, {weld.environment}", damage[weld.joint.name]
        total = of_cases.sum(axis=0)
        worst = of_cases.reshape(len(of_cases), -1)[:, int(total.argmax())]
        shares[name] = worst / max(worst.sum(), 1e-300)
        for (i, side, k), D in np.ndenumerate(total):
            tube, life = weld.joint.braces[i].tube, years / D if D > 0.0 else np.inf
            where = (name, tube.member, tube.end, SIDES[side], 45 * k, curve)
            rows.append((*where, D, life, dff, D * dff, ", ".join(weld.outside[i])))
    frame = pd.DataFrame.from_dict(shares, orient="index", columns=list(names)).rename_axis("joint")
    return pd.DataFrame(rows, columns=COLUMNS), frame


def largest_utilisations(
    frame: Frame, loads: Loads, settings: JointSettings | None = None, factor: float = 1.0
) -> dict[tuple[str, str], tuple[float, str]]:
    """Largest utilisation of each section of the tubular members, and its clause, by member and place.

    Args:
      loads: characteristic section loads; those of other members are passed over.
      factor: partial safety factor of the loads.

    Raises:
      InputError: an effective length or a yield stress belongs to no member.
    """
    s = settings or JointSettings()
    used: dict[tuple[str, str], tuple[float, str]] = {}
    for key in ("effective_lengths", "yield_stresses"):
        for name in getattr(s, key):
            if name not in frame.members:
                raise InputError(f"joints.{key}: no member {name!r}: {did_you_mean(name, frame.members)}")
    for (name, place), series in loads.items():
        member = frame.members[name]
        section = sections_of(frame, member)[place == "end"] if member.kind == "beam" else None
        if section is None or section.kind != "tube" or section.thickness is None:
            continue
        a, b = (np.asarray(frame.joints[joint]) for joint in member.joints)
        depth = max(-float(a[2] + PLACES[place] * (b[2] - a[2])), 0.0)
        closed = not member.flooded and member.filled_to is None
        checks = member_checks(
            factor * series,
            section,
            float(np.linalg.norm(b - a)),
            yield_stress=s.yield_stresses.get(name, s.yield_stress),
            standard=s.standard,
            k=s.effective_lengths.get(name, s.effective_length),
            C_m=s.moment_factor,
            pressure=factor * frame.water_density * GRAVITY * depth if closed else 0.0,
            end_caps=s.end_caps,
        )
        largest = checks.ratios.max(axis=1)
        used[name, place] = (float(largest.max()), CLAUSES[s.standard][int(largest.argmax())])
    return used
