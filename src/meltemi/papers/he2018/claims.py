"""Claims of the paper against our results.

Nothing is tuned to the paper. Its numbers are those of one minute of one seed, and are judged by the single minutes of
all our seeds; directions by the means over seeds. Neither the model of its turbine nor the edition of its wind is
certain, so a claim has a verdict in each reading of both. ``claims.csv`` says what the paper states, and by which of
``RULES`` it is judged; ``reasons.py`` why a number differs.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import pi

import numpy as np

from meltemi.papers.claim import Claim, claim_group, reasons_of, rows_of
from meltemi.papers.he2018.measures import (
    PEAK_WIDTH,
    Float,
    above_neighbours,
    change,
    edgewise,
    flap_slopes,
    harmonic_amplitude,
    likelihood,
    minutes,
    percent,
    sentence,
    share_at,
    share_of_harmonics,
    thin_airfoil,
)
from meltemi.papers.he2018.runs import (
    ADDED,
    CALM,
    CLASS_B,
    EDITION_2,
    FAST,
    FAST_MODEL,
    FULL,
    HALF,
    LESS,
    MODEL_PARTS,
    SHORT,
    SPEED,
    THREE,
    WHOLE_LEAD,
    LoadControlRuns,
)
from meltemi.papers.verdict import (
    HOLDS,
    Judged,
    Judgement,
    Verdict,
    by_reading,
    differs,
    enough,
    judgement,
    unchecked,
    unjudged,
)
from meltemi.postprocess.ensemble import MeanEstimate, mean_interval
from meltemi.postprocess.spectra import spectral_peak
from meltemi.reports.blocks import Table
from meltemi.reports.ensemble_tables import with_interval
from meltemi.simulation.rotors import build
from meltemi.simulation.trim import operating_point
from meltemi.tuning.compare import WHOLE, Comparison
from meltemi.turbine.flaps import naca64618_flap

Stated = Mapping[str, str]
"""A row of ``claims.csv``."""

LEAST_P = 0.05
"""Two-sided probability from which one more minute of ours may be the paper's."""
FEWEST_MINUTES = 40
"""Number of minutes below which no probability would be below ``LEAST_P``."""
FEW = 3
"""Minutes as far as the paper's up to which a claim is said to hold by few."""
TABLE_1_PITCH = 17.47
"""[deg] pitch of NREL's report at 20 m/s."""
TABLE_1_WITHIN = 0.1
"""[deg] tolerance of the pitch."""


@dataclass(frozen=True)
class Finding:
    """Our result beside a claim.

    Attributes:
      ours: the result in words.
      judged: whether the claim holds.
      by_few: whether it does so by few of our minutes only.
    """

    ours: str
    judged: Judged
    by_few: bool = False

    @property
    def text(self) -> str:
        """The result, with a note if few minutes decide."""
        return f"{self.ours}: holds by few" if self.by_few else self.ours


@dataclass(frozen=True)
class Rule:
    """Judgement of claims of a kind.

    Attributes:
      of: gives the finding of a reading of model and wind.
      tolerance: within which a claim holds.
    """

    of: Callable[[Comparison, Stated], Finding]
    tolerance: str = ""


@dataclass(frozen=True)
class RuleOfRuns:
    """Rule for claims that hinge on no reading, or on the model alone."""

    of: Callable[[LoadControlRuns, Stated], Finding]
    tolerance: str = ""


def claims(runs: LoadControlRuns, readings: Mapping[str, Comparison] | None = None) -> list[Claim]:
    """All claims of ``claims.csv``, judged in all readings of model and wind.

    Args:
      runs: all of them.
      readings: the paper's schemes by name of the reading; those of the runs by default.
    """
    lines = []
    for stated in rows_of("he2018", "claims.csv").values():
        judge = partial(_judged, runs, readings or runs.judged, stated)
        lines += claim_group(stated["item"], stated["where"], judge)
    return lines


def not_detuned(readings: Mapping[str, Comparison]) -> dict[str, Comparison]:
    """The readings with flaps beside an IPC that stays as it is in the place of CPFC."""
    return {name: replace(c, runs={**c.runs, "cpfc": c.runs[ADDED]}) for name, c in readings.items()}


def _judged(runs: LoadControlRuns, readings: Mapping[str, Comparison], stated: Stated) -> list[Claim]:
    rule = RULES[stated["kind"]]
    if isinstance(rule, RuleOfRuns):
        finding = rule.of(runs, stated)
    else:
        finding = _over_readings({name: rule.of(c, stated) for name, c in readings.items()}, len(runs.setup.seeds))
    judged = judgement(unchecked(f"because {stated['why']}") if stated["why"] else finding.judged)
    plain = judged.outcome == "held" and stated["basis"] != "command"
    names = ("item", "paper", "where", "basis", "reason")
    words = {name: stated[name] for name in names} | ({"reason": ""} if plain else {})
    by_few, tolerance = finding.by_few, rule.tolerance
    return [Claim(**words, ours=finding.ours, judgement=judged, tolerance=tolerance, by_few=by_few)]  # type: ignore[arg-type]


def _over_readings(findings: Mapping[str, Finding], seeds: int) -> Finding:
    ours = "; ".join(f"{name}: {finding.text}" for name, finding in findings.items())
    verdicts = {}
    for name, finding in findings.items():
        assert not isinstance(finding.judged, Judgement), "a rule judges in one reading"
        verdicts[name] = enough(seeds, finding.judged)
    return Finding(ours, by_reading(verdicts), any(finding.by_few for finding in findings.values()))


# rules, in each reading of model and wind


def scheme_change(c: Comparison, stated: Stated, window: str = WHOLE) -> Float:
    """(seeds,) change [%] of the quantity of a claim by its scheme."""
    scheme, _, base = stated["scheme"].partition("/")
    return change(c, stated["quantity"], scheme, window, base or "cpc")


def as_far(c: Comparison, stated: Stated) -> tuple[Float, int, float]:
    """(minutes,) changes [%], how many of them lie as far as the paper's, and the two-sided probability."""
    x = np.ravel([scheme_change(c, stated, name) for name in minutes(c)])
    paper = float(stated["paper"].removesuffix(" %"))
    within = int(min(np.sum(x <= paper), np.sum(x >= paper)))
    return x, within, min(2.0 * within / len(x), 1.0)


def _near(c: Comparison, stated: Stated) -> Finding:
    x, within, p = as_far(c, stated)
    low, high = np.percentile(x, [5.0, 95.0])
    ours = f"{percent(scheme_change(c, stated))}; 5 to 95 % of minutes {low:+.1f} to {high:+.1f} %, "
    ours += f"{within} of {len(x)} as far (p = {p:.2g})" if within else f"none of {len(x)} as far"
    if len(x) < FEWEST_MINUTES:
        return Finding(ours, unjudged(f"it needs {FEWEST_MINUTES} minutes, there are {len(x)}"))
    if p < LEAST_P:
        smaller = abs(x.mean()) < abs(float(stated["paper"].removesuffix(" %")))
        return Finding(ours, differs("smaller effect" if smaller else "larger effect"))
    return Finding(ours, HOLDS, by_few=within <= FEW)


def _moves(change: MeanEstimate, sign: float, verb: str) -> Verdict:
    """Verdict on the sign of a change, by its interval."""
    if min(sign * change.low, sign * change.high) > 0.0:
        return HOLDS
    return differs(f"{verb}s in the mean only" if sign * change.mean > 0.0 else f"does not {verb}")


def _falls(c: Comparison, stated: Stated) -> Finding:
    values = scheme_change(c, stated)
    return Finding(percent(values), _moves(mean_interval(values), -1.0, "fall"))


def _raised(c: Comparison, stated: Stated) -> Finding:
    n, f = int(stated["quantity"]), c.rotor_frequency()
    with_ipc, without = (
        np.array([spectral_peak(run.spectra["RootMyc1"], n * f, PEAK_WIDTH).density for run in c.runs[scheme]])
        for scheme in (stated["scheme"], "cpc")
    )
    e = mean_interval(10.0 * np.log10(with_ipc / without))
    return Finding(f"{with_interval(e, 1, '+')} dB", _moves(e, 1.0, "rise"))


def _feedforward(c: Comparison, stated: Stated) -> Finding:
    changes = {
        "alone": change(c, stated["quantity"], "feedforward"),
        "beside the feedback": change(c, stated["quantity"], "ipc", base="feedback"),
    }
    falls = [name for name, values in changes.items() if mean_interval(values).high < 0.0]
    how = f"falls {falls[0]} only" if falls else "does not fall"
    ours = ", ".join(f"{name} {percent(values)}" for name, values in changes.items())
    return Finding(ours, HOLDS if len(falls) == len(changes) else differs(how))


def _beside(c: Comparison, stated: Stated) -> Finding:
    tuned, as_it_is = (percent(change(c, stated["quantity"], s, base="ipc")) for s in ("cpfc", ADDED))
    return Finding(f"{tuned}; beside an IPC that stays as it is {as_it_is}", NONE)


def _travel(c: Comparison, stated: Stated) -> Finding:
    ratio, swing = c.values("pitch travel", stated["scheme"]) / c.values("pitch travel", "cpc"), THREE[1:]
    each = ", ".join(f"{s.upper()} {np.degrees(c.values('pitch travel', s).mean()):.2f}" for s in swing)
    return Finding(f"{with_interval(mean_interval(ratio), 1)} times that of CPC ({each} deg/s)", NONE)


def _unnoticed(c: Comparison, stated: Stated) -> Finding:
    values = scheme_change(c, stated)
    base = c.values(stated["quantity"], stated["scheme"].partition("/")[2] or "cpc")
    scatter = 100.0 * float(base.std(ddof=1) / base.mean()) if len(base) > 1 else 0.0
    ours = f"{percent(values)} (scatter {scatter:.{3 if scatter < 0.1 else 1}f} %)"
    return Finding(ours, bool(abs(values.mean()) <= scatter))


def _order(c: Comparison, stated: Stated) -> Finding:
    cpc, ipc, cpfc = (c.values(stated["quantity"], scheme) for scheme in THREE)
    in_order = (cpfc < ipc) & (ipc < cpc)
    ours = f"in {in_order.sum()} of {len(cpc)} seeds"
    return Finding(ours, HOLDS if in_order.all() else differs("not in every seed"))


def _peak(c: Comparison, stated: Stated) -> Finding:
    n = int(stated["quantity"])
    before, after = (above_neighbours(c, scheme, n) for scheme in ("cpc", stated["scheme"]))
    how = differs("reduced" if after < before else "does not fall")
    return Finding(f"{before:+.1f} dB with CPC, {after:+.1f} dB left", HOLDS if after <= 0.0 else how)


def _pitch(c: Comparison, stated: Stated) -> Finding:
    ipc, cpc = (c.results(scheme).between(*c.windows[WHOLE]) for scheme in ("ipc", "cpc"))
    share = share_at(ipc["pitch_1"] - cpc["pitch_1"], ipc.time, c.rotor_frequency())
    size, offset = np.degrees([harmonic_amplitude(ipc, "pitch_1", 1), ipc["pitch_1"].mean() - cpc["pitch_1"].mean()])
    return Finding(f"{100 * share:.0f} % at 1P, {size:.2f} deg, mean {offset:+.2f} deg", share > 0.5)


def _flaps(c: Comparison, stated: Stated) -> Finding:
    part = c.results("cpfc").between(*c.windows[WHOLE])
    x = part["flap_1_angle_1"]
    share = share_at(x, part.time, 2.0 * c.rotor_frequency(), 0.25)
    largest = np.degrees(np.abs(x).max())
    return Finding(f"{100 * share:.0f} % at 2P, at most {largest:.1f} deg", share > 0.5)


# rules of claims that hinge on no reading of the wind


def _absolute(runs: LoadControlRuns, stated: Stated) -> Finding:
    c = runs.readings[CLASS_B]
    units = {q.name: (q.unit, q.factor) for q in c.quantities}
    parts = []
    for name in stated["quantity"].split(";"):
        unit, factor = units[name]
        each = ", ".join(f"{s.upper()} {factor * float(c.values(name, s).mean()):.4g}" for s in THREE)
        parts.append(f"{each} {unit}")
    return Finding("; ".join(parts) + f" ({CLASS_B})", NONE)


def _turbine(runs: LoadControlRuns, stated: Stated) -> Finding:
    turbine = runs.bench.model.turbine
    models = {FAST: build(turbine, FAST_MODEL), FULL: runs.bench.model}
    pitch = {name: float(np.degrees(operating_point(model, SPEED).pitch)) for name, model in models.items()}
    ours = ", ".join(f"{name} {angle:.2f} deg" for name, angle in pitch.items())
    near = {model: abs(x - TABLE_1_PITCH) <= TABLE_1_WITHIN for model, x in pitch.items()}
    return Finding(ours, by_reading({name: near[name.partition(",")[0]] for name in runs.judged}))


def _flap(runs: LoadControlRuns, stated: Stated) -> Finding:
    (lift, moment), (ideal, ideal_moment) = flap_slopes(), thin_airfoil(naca64618_flap().chord_fraction)
    ours = (
        f"{lift * pi / 180:.4f} per deg, {lift / ideal:.2f} of thin-airfoil theory ({ideal * pi / 180:.4f}); moment "
        f"{moment * pi / 180:.4f}, {moment / ideal_moment:.2f} of it"
    )
    return Finding(ours, 0.0 < lift < ideal)


NONE = unchecked("")
"""Rule for claims that cannot be checked, for the reason that ``claims.csv`` states."""
RULES: Mapping[str, Rule | RuleOfRuns] = {
    "near": Rule(_near, f"two-sided p of at least {LEAST_P:g} among the single minutes of all seeds"),
    "raised": Rule(_raised, "95 % interval of our mean over seeds, above zero"),
    "feedforward": Rule(_feedforward, "95 % intervals of our means over seeds, below zero"),
    "travel": Rule(_travel),
    "beside": Rule(_beside),
    "falls": Rule(_falls, "95 % interval of our mean over seeds, below zero"),
    "unnoticed": Rule(_unnoticed, "standard deviation of the reference's value over seeds"),
    "order": Rule(_order, "in every seed"),
    "peak": Rule(_peak, "no higher than midway to its neighbours"),
    "pitch": Rule(_pitch, "more than half of the variance"),
    "flaps": Rule(_flaps, "more than half of the variance"),
    "absolute": RuleOfRuns(_absolute),
    "turbine": RuleOfRuns(_turbine, f"{TABLE_1_WITHIN:g} deg"),
    "flap slope": RuleOfRuns(_flap, "none: a limit"),
}
"""Rules by the column ``kind`` of ``claims.csv``."""


STATED_MYC = [rows_of("he2018", "claims.csv")[key] for key in ("1", "2", "24", "25")]
"""Standard deviation and equivalent load of RootMyc1, by IPC and CPFC."""


def reasons(runs: LoadControlRuns) -> dict[str, str]:
    """Reasons for differences, by key, each with the experiment that shows it."""
    c = runs.readings[CLASS_B]
    calm, less = ({FAST: runs.study(f"{FAST}, {name}"), FULL: runs.study(name)} for name in (CALM, LESS))
    loops = {scheme: runs.bench.loops(scheme)[0] for scheme in THREE[1:]}
    parts = {**{name: runs.study(name) for name in MODEL_PARTS}, "with all three": runs.fast[CLASS_B]}
    over = partial(change, quantity="RootMyc1 std", scheme="cpfc", base="ipc")
    second = {name: x for name, x in runs.judged.items() if name.endswith(SHORT[EDITION_2])}
    words = {
        "shares": _each(runs.judged, lambda c: f"{share_of_harmonics(c):.0f} %"),
        "asked": f"{100.0 * (1.0 - (1.0 - 0.553) ** 2):.0f}",
        "less": _each(less, lambda c: ", ".join(_change_and_p(c, row) for row in STATED_MYC)),
        "over": percent(over(c)),
        "parts": ", ".join(
            f"{with_interval(mean_interval(over(x) - over(c)), 1, '+')} percentage points {name}"
            for name, x in parts.items()
        ),
        "second": _each(second, lambda c: f"{percent(over(c, quantity='RootMyc1 DEL'))} and {percent(over(c))}"),
        "edge": _each({FAST: runs.fast[CLASS_B], FULL: c}, _edge),
        "whole": percent(change(c, "RootMxc1 DEL", WHOLE_LEAD)),
        "likely": _each(runs.judged, likelihood),
        "factor": f"{loops['cpfc'].integral_gain / loops['ipc'].integral_gain:.2f}",
        "half": _each(runs.judged, lambda c: percent(change(c, "RootMyc1 DEL", HALF))),
        "calm": _each(calm, lambda c: _alone(c, "feedforward")),
        "calm_half": _each(calm, lambda c: _alone(c, HALF)),
    }
    return {key: text.format(**words) for key, text in reasons_of("he2018").items()}


def _each(comparisons: Mapping[str, Comparison], words: Callable[[Comparison], str]) -> str:
    return "; ".join(f"{name}: {words(c)}" for name, c in comparisons.items())


def _change_and_p(c: Comparison, stated: Stated) -> str:
    x, within, _ = as_far(c, stated)
    what = f"{stated['quantity'].split()[1]} {percent(scheme_change(c, stated))} by {stated['scheme'].upper()}"
    return f"{what} ({within} of {len(x)} minutes as far)"


def _edge(c: Comparison) -> str:
    return ", ".join(f"{edgewise(c, scheme) * 1e-3:.0f} kN m with {scheme.upper()}" for scheme in THREE)


def _alone(c: Comparison, scheme: str) -> str:
    return percent(change(c, "RootMyc1 DEL", scheme))


def counted(lines: Sequence[Claim]) -> list[Claim]:
    """Claims that the paper states and that can be checked."""
    return [c for c in lines if c.basis == "paper" and c.outcome != "unchecked"]


def count_by_reading(lines: Sequence[Claim], readings: Sequence[str]) -> list[int]:
    """Number of those that hold in each of the readings."""
    verdicts = [c.judgement.in_readings(readings) for c in counted(lines)]
    return [sum(v[k] == HOLDS for v in verdicts) for k in range(len(readings))]


def verdicts_table(lines: Sequence[Claim], added: Sequence[Claim], readings: Sequence[str]) -> Table:
    """Counts by reading, and the claims on which readings differ or that hold in none.

    Args:
      lines: all claims.
      added: all claims with flaps added to an unchanged IPC.
      readings: names.
    """
    whole = len(counted(lines))
    rows = [
        ["hold", *(f"{k} of {whole}" for k in count_by_reading(lines, readings))],
        [
            "hold, flaps beside an IPC that stays as it is",
            *(f"{k} of {whole}" for k in count_by_reading(added, readings)),
        ],
        *(
            [c.item, *(v.text for v in c.judgement.in_readings(readings))]
            for c in counted(lines)
            if c.outcome != "held"
        ),
    ]
    note = "All other claims that can be checked hold in every reading."
    return Table(["claim", *readings], rows, "Verdicts by model and wind", text_columns=len(readings) + 1, note=note)


def counts_words(lines: Sequence[Claim], added: Sequence[Claim], readings: Sequence[str]) -> str:
    """Sentences on the counts."""
    checked = counted(lines)
    whole, unchecked = len(checked), sum(c.outcome == "unchecked" for c in lines if c.basis == "paper")
    if any(v.outcome == "unjudged" for c in checked for _, v in c.judgement.verdicts):
        return f"The {whole} claims of the paper that can be checked are not all judged by these runs."
    verdicts = [c.judgement.in_readings(readings) for c in checked]
    every = sum(all(v == HOLDS for v in each) for each in verdicts)
    none = sum(all(v != HOLDS for v in each) for each in verdicts)
    few = sum(c.by_few for c in checked)
    each = ", ".join(f"{k} with {name}" for k, name in zip(count_by_reading(lines, readings), readings, strict=True))
    other = ", ".join(map(str, count_by_reading(added, readings)))
    numbers = {"whole": whole, "every": every, "some": whole - every - none, "none": none, "unchecked": unchecked}
    return sentence("counts", each=each, other=other, few=few, **numbers)
