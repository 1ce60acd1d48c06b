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
        hidden = (round(abs(mean), 1) > target) != (abs(mean) > target)  # by one digit
        text = f"{mean:+.{1 + hidden}f}"
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


def target(record: str, key: tuple[str, str]) -> float:
    """[%] of a record; infinite without one."""
    return math.inf if record.startswith("stable") and key[1] == "mean" else TARGETS.get(key, math.inf)


def tables(rows: Sequence[dict[str, str]]) -> dict[str, list[str]]:
    """Tables of the page by name."""
    s = Study(rows)
    records, of = s.names(), s.of
    made = {}
    head = [
        "record",
        "wind m/s",
        "turbulence %",
        *(f"{WORDS[c]}, {x}" for c, x in TARGETS),
        "flap moment, mean (not judged)",
    ]
    made["records"] = markdown_table(head, [
        [r, f"{of['deck', r, 'wind', 'mean'][0]:.2f}", f"{100.0 * of['deck', r, 'wind', 'turbulence'][0]:.1f}",
         *(s.text("deck", r, *key, target(r, key)) for key in TARGETS), s.text("deck", r, FLAP, "mean")]
        for r in records
    ])  # fmt: skip
    rest = [(POWER, "std"), (POWER, SHOWN[2]), (SPEED, "std"), (SPEED, SHOWN[2]), (TORQUE, "mean"), (TORQUE, "std")]
    made["rest"] = markdown_table(
        ["record", *(f"{WORDS[c]}, {x}" for c, x in rest)],
        [[r, *(s.text("deck", r, *key) for key in rest)] for r in records],
    )
    lines = []
    for key, limit in TARGETS.items():
        judged = [r for r in records if ("deck", r, *key) in of and target(r, key) < math.inf]
        missed = [r for r in judged if abs(s.deviation("deck", r, *key)[0]) > limit]
        lines.append(
            [
                f"{WORDS[key[0]]}, {key[1]}",
                f"{limit:g} %",
                f"{len(judged) - len(missed)} of {len(judged)}",
                ", ".join(missed),
            ]
        )
    made["targets"] = markdown_table(["quantity", "target", "met", "missed"], lines)
    lines = []
    for channel in WORDS:
        for statistic in SHOWN[channel == FLAP :]:
            x = np.array([of["deck", r, channel, statistic] for r in s.names(channel=channel)])
            a = agreement(channel, statistic, x[:, 0], x[:, 1:])
            numbers = (
                f"{100 * a.bias:+.1f}",
                f"{100 * a.half:.1f}",
                f"{100 * a.resolvable:.1f}",
                f"{100 * a.covered:.0f}",
            )
            lines.append([WORDS[channel], statistic, str(a.records), *numbers, a.verdict])
    head = [
        "quantity",
        "statistic",
        "records",
        "bias %",
        "interval ± %",
        "resolvable ± %",
        "records within seeds %",
        "verdict",
    ]
    made["agreement"] = markdown_table(head, lines)
    lines = []
    for r in records:
        ratio = of["drive", r, POWER, "over torque and speed"][0]
        power, speed = (1.0 + 0.01 * s.deviation("deck", r, c, "mean")[0] for c in (POWER, SPEED))
        shown = (s.text(e, r, c, "mean") for e, c in (("deck", SPEED), ("torque", SPEED), ("deck", TORQUE)))
        lines.append([r, f"{ratio:.4f}", f"{1e4 * of['drive', r, TORQUE, 'over speed squared'][0]:.3f}", *shown,
                      f"{100.0 * (power / speed * ratio / s.efficiency - 1.0):+.1f}"])  # fmt: skip
    head = [
        "record",
        "power over torque and speed",
        "torque over speed² 1e-4 N m/rpm²",
        "speed",
        "speed, torque x 1.066",
    ]
    made["drive"] = markdown_table([*head, "torque", "torque, by the definition of the channel"], lines)
    lines = []
    for r in records:
        own, simulated = (f(of["deck", r, POWER, "mean"][k]) for f, k in ((float, 0), (np.mean, slice(1, None))))
        change = 100.0 * ((own / simulated) ** (1.0 / 3.0) - 1.0)
        lines.append(
            [
                r,
                f"{1e-3 * own:.1f}",
                f"{1e-3 * (simulated - own):+.2f}",
                s.text("deck", r, POWER, "mean"),
                f"{change:+.1f}",
            ]
        )
    head = [
        "record",
        "measured power kW",
        "deviation kW",
        "deviation %",
        "change of the wind that gives the measured power %",
    ]
    made["excess"] = markdown_table(head, lines)
    loads = [(FLAP, x) for x in SHOWN[1:]]
    made["shear"] = markdown_table(
        ["record", *(f"{x}, exponent {e}" for _, x in loads for e in ("0.50", "0.14"))],
        [[r, *(s.text(e, r, *key) for key in loads for e in ("deck", "shear 0.14"))] for r in s.names("shear 0.14")],
    )
    lines = []
    for r in records:
        (own, *seeds), (lag, *lags) = (of["blocks", r, POWER, x] for x in ("correlation", "lag"))
        travel = 67.5 / of["deck", r, "wind", "mean"][0]
        simulated = f"{np.mean(seeds):.2f} ± {np.std(seeds, ddof=1):.2f}"
        lines.append([r, f"{travel:.0f}", f"{own:.2f}", f"{lag:.0f}", simulated,
                      f"{min(lags):.0f} to {max(lags):.0f}"])  # fmt: skip
    head = ["record", "travel s", "measured correlation", "measured lag s", "simulated correlation", "simulated lag s"]
    made["blocks"] = markdown_table(head, lines)
    keys = [(POWER, "mean"), (POWER, "std"), (SPEED, "std")]
    lines = []
    for name in ("deck", "mast at tower", "mast 10 m aside", "mast 20 m aside", "yaw 8 deg"):
        bias = [np.mean([s.deviation(name, r, c, x)[0] for r in records]) for c, x in keys]
        cells = [
            f"{b:+.1f}; {s.covered(name, *key)[1]:.1f}; {s.covered(name, *key)[0]}"
            for b, key in zip(bias, keys, strict=True)
        ]
        lines.append([name, *cells, s.text(name, "unstable_04", POWER, "mean")])
    head = [
        "experiment",
        *(f"{WORDS[c]}, {x}: deviation %; spread %; records inside" for c, x in keys),
        "unstable_04, power",
    ]
    made["mast"] = markdown_table(head, lines)
    keys = [(SPEED, "mean"), (SPEED, "std"), (POWER, "std"), (TORQUE, "std")]
    made["slip"] = markdown_table(
        ["record", *(f"{WORDS[c]}, {x}: {e}" for c, x in keys for e in ("deck", "slope"))],
        [[r, *(s.text(e, r, *key) for key in keys for e in ("deck", "slip"))] for r in s.names("slip")],
    )
    lines = []
    for name in ("17 points", "dt 0.05 s"):
        for r in s.names(name):
            change = [
                100.0 * (of[name, r, c, SHOWN[2]][1:].mean() / of["deck", r, c, SHOWN[2]][1:].mean() - 1.0)
                for c in WORDS
            ]
            lines.append(
                [
                    name,
                    r,
                    *(
                        f"{x:+.1f} ({s.deviation('deck', r, c, SHOWN[2])[1]:.1f})"
                        for x, c in zip(change, WORDS, strict=True)
                    ),
                ]
            )
    made["grid"] = markdown_table(["field", "record", *WORDS.values()], lines)
    return made


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
