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
from meltemi.frames.joints.sn import Curve, Environment, sn_curve, spectral_damage
from meltemi.frames.joints.utilisation import CLAUSES, member_checks
from meltemi.postprocess.cycles import Cycles, rainflow_cycles, sum_cycles
from meltemi.postprocess.spectra import power_spectrum

if TYPE_CHECKING:
    import pandas as pd

Float = NDArray[np.float64]

GRAVITY = 9.80665
PLACES = ("start", "middle", "end")
"""Places of the section loads of a member."""


class Weld(NamedTuple):
    """Welds of a joint, ready for series.

    Attributes:
      joint, factors: the joint, and the stress concentration factors of its braces.
      curve, environment: their S-N curve.
      outside: names of the parameters outside the ranges of validity, by brace.
    """

    joint: Joint
    factors: list[Factors]
    curve: Curve
    environment: Environment
    outside: list[list[str]]

    def thickness(self, brace: int, side: int) -> float:
        """[m] of the wall on a side of a brace's weld."""
        return self.joint.thickness if side == 0 else self.joint.braces[brace].tube.thickness


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
      InputError: there is no such S-N curve, or no joint of tubes.
    """
    welds = []
    for joint in tubular_joints(frame):
        given = parameters_of(joint, settings.alpha)
        f = [factors(p, settings.fixity, settings.chord_bending) for p in given]
        around = environment_at(joint.height, settings)
        curve = sn_curve(settings.curve, around, settings.edition)
        welds.append(Weld(joint, f, curve, around, [outside(p) for p in given]))
    if not welds:
        raise InputError("joints: the frame has no joint at which a tube meets a chord")
    return welds


def stresses_of(weld: Weld, loads: Loads, settings: JointSettings) -> Float:
    """Hot-spot stresses (n, 2, 8, T) [N/m^2] of a joint's welds."""
    bending = settings.chord_bending == "frame"
    return hot_spots(weld.joint, weld.factors, loads, settings.classification, bending=bending)


def case_damage(weld: Weld, stresses: Float, duration: float, settings: JointSettings) -> Float:
    """Damage (n, 2, 8) of a joint's welds by hot-spot stresses (n, 2, 8, T) of a duration [s]."""
    damage = np.zeros(stresses.shape[:3])
    for i, side, k in np.ndindex(damage.shape):
        x, thickness = stresses[i, side, k], weld.thickness(i, side)
        if settings.counting == "rainflow":
            damage[i, side, k] = weld.curve.damage(rainflow_cycles(x), thickness)
        else:
            spectrum = power_spectrum(x, dt=duration / (len(x) - 1))
            damage[i, side, k] = spectral_damage(spectrum.frequency, spectrum.density, duration, weld.curve, thickness)
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
    welds = welds_of(frame, s)
    repeated = np.array([case.hours * 3600.0 / case.duration for case in cases])
    damage, markov = {}, {}
    for weld in welds:
        single = np.array([case_damage(weld, stresses_of(weld, case.loads, s), case.duration, s) for case in cases])
        damage[weld.joint.name] = repeated[:, None, None, None] * single
        total = damage[weld.joint.name].sum(axis=0)
        worst = np.unravel_index(int(total.argmax()), total.shape)
        parts = (rainflow_cycles(stresses_of(weld, case.loads, s)[worst]) for case in cases)
        markov[weld.joint.name] = sum_cycles(parts, repeated.tolist())
    return fatigue_tables(welds, damage, [case.name for case in cases], markov, s, years)


def fatigue_tables(
    welds: Iterable[Weld],
    damage: Mapping[str, Float],
    names: Sequence[str],
    markov: Mapping[str, Cycles],
    settings: JointSettings,
    years: float,
) -> JointFatigue:
    """Tables of the damage (cases, n, 2, 8) of each joint."""
    import pandas as pd

    rows, shares = [], {}
    for weld in welds:
        of_cases = damage[weld.joint.name]
        total = of_cases.sum(axis=0)
        worst = of_cases.reshape(len(of_cases), -1)[:, int(total.argmax())]
        shares[weld.joint.name] = worst / max(worst.sum(), 1e-300)
        for i, side, k in np.ndindex(total.shape):
            tube, D, dff = weld.joint.braces[i].tube, float(total[i, side, k]), settings.design_fatigue_factor
            head = (
                weld.joint.name,
                tube.member,
                tube.end,
                SIDES[side],
                45 * k,
                f"{settings.curve}, {weld.environment}",
            )
            rows.append((*head, D, years / D if D > 0.0 else np.inf, dff, D * dff, ", ".join(weld.outside[i])))
    columns = "joint brace end side position curve damage life DFF utilisation outside".split()
    table = pd.DataFrame(rows, columns=columns)
    frame = pd.DataFrame.from_dict(shares, orient="index", columns=list(names)).rename_axis("joint")
    return JointFatigue(table, frame, dict(markov))


def largest_utilisations(
    frame: Frame, loads: Loads, settings: JointSettings | None = None, factor: float = 1.0
) -> dict[tuple[str, str], tuple[float, str]]:
    """Largest utilisation of each section of the tubular members, and its clause, by member and place.

    Args:
      loads: characteristic section loads; those of other members are passed over.
      factor: partial safety factor of the loads.

    Raises:
      InputError: an effective length belongs to no member.
    """
    s = settings or JointSettings()
    used: dict[tuple[str, str], tuple[float, str]] = {}
    for name in s.effective_lengths:
        if name not in frame.members:
            raise InputError(f"joints.effective_lengths: no member {name!r}: {did_you_mean(name, frame.members)}")
    for name, member in frame.members.items():
        section = frame.sections.get(member.section)
        if member.kind != "beam" or section is None or section.kind != "tube" or section.thickness is None:
            continue
        a, b = (np.asarray(frame.joints[joint]) for joint in member.joints)
        closed = not member.flooded and member.filled_to is None
        for place, share in zip(PLACES, (0.0, 0.5, 1.0), strict=True):
            if (name, place) not in loads:
                continue
            at_end = frame.sections[member.end_section or member.section] if place == "end" else section
            depth = max(-float(a[2] + share * (b[2] - a[2])), 0.0)
            checks = member_checks(
                factor * loads[name, place],
                at_end,
                float(np.linalg.norm(b - a)),
                yield_stress=s.yield_stress,
                standard=s.standard,
                k=s.effective_lengths.get(name, s.effective_length),
                C_m=s.moment_factor,
                pressure=frame.water_density * GRAVITY * depth * factor if closed else 0.0,
                end_caps=s.end_caps,
            )
            largest = checks.ratios.max(axis=1)
            used[name, place] = (float(largest.max()), CLAUSES[s.standard][int(largest.argmax())])
    return used
