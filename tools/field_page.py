"""Tables and figures of docs/verification/field.md: ``python tools/field_page.py``, after ``tools/field_study.py``."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from meltemi.report.palette import COLOURS, INK, SHADE
from meltemi.report.plots import heading, new_figure, save
from meltemi.report.tables import markdown_table
from meltemi.validation.comparison import agreement, prediction_half

DOCS = Path(__file__).parents[1] / "docs/verification"
POWER, TORQUE, SPEED, FLAP = "generator_power", "generator_torque", "rotor_speed", "root_moment_flap_1"
SHOWN = ("mean", "std", "DEL, m = 10")


class Study:
    """Rows of field.csv: measured values and (K,) values of the seeds by experiment, record, channel and statistic."""

    def __init__(self, rows: Sequence[dict[str, str]]) -> None:
        self.of = {tuple(r.values())[:4]: np.array([float(x) for x in list(r.values())[4:] if x]) for r in rows}
        self.efficiency = float(self.of["drive", "deck", POWER, "efficiency"][0])

    def names(self, experiment: str = "deck", channel: str = SPEED) -> list[str]:
        """Records of an experiment that have a channel."""
        return [k[1] for k in self.of if k[0] == experiment and k[2:] == (channel, "mean")]

    def deviation(self, experiment: str, record: str, channel: str, statistic: str) -> tuple[float, float]:
        """[%] of the mean of the seeds from the measured value, and standard deviation of the seeds."""
        x = self.of[experiment, record, channel, statistic]
        return 100.0 * (x[1:].mean() / x[0] - 1.0), 100.0 * x[1:].std(ddof=1) / x[0]

    def text(self, experiment: str, record: str, channel: str, statistic: str, target: float = math.inf) -> str:
        """A cell: deviation and spread, bold beyond the target."""
        if (experiment, record, channel, statistic) not in self.of:
            return ""
        mean, spread = self.deviation(experiment, record, channel, statistic)
        text = f"{mean:+.{1 + ((round(abs(mean), 1) > target) != (abs(mean) > target))}f}"  # digits that show it
        return (f"**{text}**" if abs(mean) > target else text) + f" ± {spread:.1f}"

    def covered(self, experiment: str, channel: str, statistic: str) -> tuple[int, float]:
        """Records whose measured value lies in the prediction interval of the seeds, and mean spread [%]."""
        x = np.array([self.of[experiment, r, channel, statistic] for r in self.names(experiment)])
        spread, count = x[:, 1:].std(axis=1, ddof=1), x.shape[1] - 1
        inside = abs(x[:, 1:].mean(axis=1) - x[:, 0]) <= prediction_half(spread, np.full(len(x), count))
        return int(inside.sum()), float(np.mean(100.0 * spread / x[:, 0]))


TARGETS = {(POWER, "mean"): 5.0, (SPEED, "mean"): 1.0, (FLAP, "std"): 10.0, (FLAP, SHOWN[2]): 15.0}
"""[%] of records: power and speed in neutral and unstable ones."""
WORDS = {POWER: "power", TORQUE: "generator torque", SPEED: "rotor speed", FLAP: "flap moment"}


def target(record: str, experiment: str, key: Sequence[str]) -> float:
    """[%] of a record in the comparison; infinite without one."""
    judged = experiment == "deck" and not (record.startswith("stable") and key[1] == "mean")
    return TARGETS.get((key[0], key[1]), math.inf) if judged else math.inf


def named(key: Sequence[str]) -> str:
    """Channel and statistic."""
    return f"{WORDS[key[0]]}, {key[1]}"


def compared(s: Study, columns: dict[str, tuple[str, str, str]], experiment: str = "deck") -> list[str]:
    """Table of the records of an experiment: columns are experiment, channel, statistic by their heads."""
    rows = []
    for r in s.names(experiment):
        wind = f"{s.of['deck', r, 'wind', 'mean'][0]:.2f}", f"{100.0 * s.of['deck', r, 'wind', 'turbulence'][0]:.1f}"
        rows.append([r, *wind, *(s.text(e, r, *key, target(r, e, key)) for e, *key in columns.values())])
    return markdown_table(["record", "wind m/s", "turbulence %", *columns], rows)


def judged(s: Study) -> list[str]:
    """Table of targets met and missed."""
    rows = []
    for key, limit in TARGETS.items():
        some = [r for r in s.names(channel=key[0]) if target(r, "deck", key) < math.inf]
        missed = [r for r in some if abs(s.deviation("deck", r, *key)[0]) > limit]
        rows.append([named(key), f"{limit:g} %", f"{len(some) - len(missed)} of {len(some)}", ", ".join(missed)])
    return markdown_table(["quantity", "target", "met", "missed"], rows)


def agreements(s: Study) -> list[str]:
    """Table of the agreement over all records."""
    rows = []
    for channel in WORDS:
        for statistic in SHOWN[channel == FLAP :]:
            x = np.array([s.of["deck", r, channel, statistic] for r in s.names(channel=channel)])
            a = agreement(channel, statistic, x[:, 0], x[:, 1:])
            per_cent = [f"{100.0 * value:.1f}" for value in (a.half, a.resolvable, a.covered)]
            rows.append([named((channel, statistic)), str(a.records), f"{100.0 * a.bias:+.1f}", *per_cent, a.verdict])
    head = "quantity|records|bias %|interval ± %|resolvable ± %|records within seeds %|verdict"
    return markdown_table(head.split("|"), rows)


def drives(s: Study) -> list[str]:
    """Table of drive, speed and torque."""
    rows = []
    for r in s.names():
        (ratio,), (gain,) = (
            s.of["drive", r, POWER, "over torque and speed"],
            s.of["drive", r, TORQUE, "over speed squared"],
        )
        power, speed = (1.0 + 0.01 * s.deviation("deck", r, c, "mean")[0] for c in (POWER, SPEED))
        shown = (s.text(e, r, c, "mean") for e, c in (("deck", SPEED), ("torque", SPEED), ("deck", TORQUE)))
        implied = 100.0 * (power / speed * ratio / s.efficiency - 1.0)
        rows.append([r, f"{ratio:.4f}", f"{1e4 * gain:.3f}", *shown, f"{implied:+.1f}"])
    head = "record|power over torque and speed|torque over speed² 1e-4 N m/rpm²|speed|speed, torque law x 1.066|torque"
    return markdown_table([*head.split("|"), "torque, by the definition of the channel"], rows)


def excesses(s: Study) -> list[str]:
    """Table of the deviation of the power in kW and as wind."""
    rows = []
    for r in s.names():
        measured, *seeds = 1e-3 * s.of["deck", r, POWER, "mean"]
        excess, wind = np.mean(seeds) - measured, 100.0 * ((measured / np.mean(seeds)) ** (1.0 / 3.0) - 1.0)
        rows.append([r, f"{measured:.1f}", f"{excess:+.2f}", s.text("deck", r, POWER, "mean"), f"{wind:+.1f}"])
    head = "record|measured power kW|deviation kW|deviation %|change of the wind that gives the measured power %"
    return markdown_table(head.split("|"), rows)


def correlations(s: Study) -> list[str]:
    """Table of mast and power."""
    rows = []
    for r in s.names():
        (measured, *seeds), (lag, *lags) = (s.of["blocks", r, POWER, x] for x in ("correlation", "lag"))
        simulated = f"{np.mean(seeds):.2f} ± {np.std(seeds, ddof=1):.2f}", f"{min(lags):.0f} to {max(lags):.0f}"
        rows.append(
            [r, f"{67.5 / s.of['deck', r, 'wind', 'mean'][0]:.0f}", f"{measured:.2f}", f"{lag:.0f}", *simulated]
        )
    head = "record|travel s|measured correlation|measured lag s|simulated correlation|simulated lag s"
    return markdown_table(head.split("|"), rows)


def masts(s: Study) -> list[str]:
    """Table of the experiments on the wind between mast and rotor."""
    keys, rows = [(POWER, "mean"), (POWER, "std"), (SPEED, "std")], []
    for name in ("deck", "mast at tower", "mast 10 m aside", "mast 20 m aside", "yaw 8 deg"):
        bias = [np.mean([s.deviation(name, r, *key)[0] for r in s.names()]) for key in keys]
        both = [s.covered(name, *key) for key in keys]
        cells = [f"{x:+.1f}; {spread:.1f}; {inside}" for x, (inside, spread) in zip(bias, both, strict=True)]
        rows.append([name, *cells, s.text(name, "unstable_04", POWER, "mean")])
    return markdown_table(["experiment", *map(named, keys), "unstable_04: power, mean"], rows)


def grids(s: Study) -> list[str]:
    """Table of the changes of equivalent loads by points and step of the wind's fields."""
    rows = []
    for name in ("17 points", "dt 0.05 s"):
        for r in s.names(name):
            pairs = [[s.of[e, r, c, SHOWN[2]][1:].mean() for e in (name, "deck")] for c in WORDS]
            spread = [s.deviation("deck", r, c, SHOWN[2])[1] for c in WORDS]
            rows.append(
                [name, r, *(f"{100.0 * (x / y - 1.0):+.1f} ({z:.1f})" for (x, y), z in zip(pairs, spread, strict=True))]
            )
    return markdown_table(["field", "record", *WORDS.values()], rows)


def tables(rows: Sequence[dict[str, str]]) -> dict[str, list[str]]:
    """Tables of the page by name."""
    s = Study(rows)
    rest = [(POWER, "std"), (POWER, SHOWN[2]), (SPEED, "std"), (SPEED, SHOWN[2]), (TORQUE, "mean"), (TORQUE, "std")]
    near = [(SPEED, "mean"), (SPEED, "std"), (POWER, "std"), (TORQUE, "std")]
    shears = {
        f"{x}, exponent {e}": (n, FLAP, x) for x in SHOWN[1:] for e, n in (("0.50", "deck"), ("0.14", "shear 0.14"))
    }
    laws = {"deck": "deck", "slope": "slip"}
    records = {named(key): ("deck", *key) for key in TARGETS} | {
        "flap moment, mean (not judged)": ("deck", FLAP, "mean")
    }
    return {
        "records": compared(s, records),
        "targets": judged(s),
        "rest": compared(s, {named(key): ("deck", *key) for key in rest}),
        "agreement": agreements(s),
        "drive": drives(s),
        "excess": excesses(s),
        "shear": compared(s, shears, "shear 0.14"),
        "blocks": correlations(s),
        "mast": masts(s),
        "slip": compared(s, {f"{named(key)}: {e}": (n, *key) for key in near for e, n in laws.items()}, "slip"),
        "grid": grids(s),
    }  # fmt: skip


def put(text: str, rows: Sequence[dict[str, str]]) -> str:
    """The page with its tables between ``<!-- NAME -->`` and ``<!-- end of NAME -->``."""
    for name, lines in tables(rows).items():
        begin, end = f"<!-- {name} -->", f"<!-- end of {name} -->"
        before, _, after = text.partition(begin)
        text = f"{before}{begin}\n\n" + "\n".join(lines) + f"\n\n{end}{after.split(end, 1)[1]}"
    return text


def draw(rows: Sequence[dict[str, str]]) -> None:
    """The figures: deviations by record; power over torque and speed, and torque near rated speed."""
    s = Study(rows)
    records = s.names()
    figure, ((power, speed, flap),) = new_figure(1, 3, size=(9.6, 3.8), share=False)
    both = "deck", "torque"
    shown = (power, [(e, (POWER, "mean"), e) for e in both]), (speed, [(e, (SPEED, "mean"), e) for e in both])
    for ax, series in (*shown, (flap, [("deck", (FLAP, x), x) for x in SHOWN[1:]])):
        limit = TARGETS[series[0][1]]
        ax.axvspan(-limit, limit, color=SHADE, label=f"target, {limit:g} %")
        for n, (experiment, key, label) in enumerate(series):
            some = [
                (i, *s.deviation(experiment, r, *key)) for i, r in enumerate(records) if (experiment, r, *key) in s.of
            ]
            y, mean, spread = np.array(some).T
            look = {
                "fmt": "os"[n],
                "markersize": 4,
                "color": COLOURS[n],
                "label": label.replace("torque", "torque law x 1.066"),
            }
            ax.errorbar(mean, y + 0.24 * n - 0.12, xerr=2.0 * spread, **look)
        ax.set(xlabel="deviation [%]", ylim=(len(records) - 0.5, -0.5))
        ax.set_yticks(range(len(records)), records if ax is power else [])
        ax.legend(fontsize=7, loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=3, columnspacing=1.0)
    for ax, title in ((power, "Power, mean"), (speed, "Rotor speed, mean"), (flap, "Flap moment")):
        heading(ax, title)
    save(figure, DOCS / "field_deviations.png")
    figure, ((ratio, torque),) = new_figure(1, 2, size=(9.6, 3.4), share=False)
    for colour, kind in zip(COLOURS, ("neutral", "stable", "unstable"), strict=False):
        mine = [r for r in records if r.startswith(kind)]
        x = [1e-3 * s.of["deck", r, POWER, "mean"][0] for r in mine]
        ratio.plot(
            x, [s.of["drive", r, POWER, "over torque and speed"][0] for r in mine], "o", color=colour, label=kind
        )
    ratio.axhline(s.efficiency, color=INK, linewidth=1.0, label="efficiency of the deck")
    ratio.set(xlabel="mean power [kW]", ylabel="[-]")
    heading(ratio, "Power over torque and speed")
    torques = [(k[1], (float(k[3]), *x)) for k, x in s.of.items() if k[0] in ("near rated", "law")]
    curve = {n: np.array([point for name, point in torques if name == n])
             for n in ("neutral", "deck", "slope")}  # fmt: skip
    x, y, spread = curve["neutral"].T
    torque.errorbar(x, y, yerr=spread, fmt="o", markersize=4, color=COLOURS[0], label="measured, neutral, and its std")
    torque.plot(*curve["deck"].T, color=INK, label="deck")
    torque.plot(*curve["slope"].T, color=COLOURS[1], linestyle="--", label="measured slope")
    torque.set(xlabel="generator speed [rpm]", ylabel="[N m]", ylim=(400.0, 1400.0))
    heading(torque, "Generator torque")
    for ax in (ratio, torque):
        ax.legend(fontsize=7)
    save(figure, DOCS / "field_drive.png")


def main() -> None:
    """Write tables and figures."""
    with (DOCS / "field.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    page = DOCS / "field.md"
    page.write_text(put(page.read_text(encoding="utf-8"), rows), encoding="utf-8")
    draw(rows)


if __name__ == "__main__":
    main()
