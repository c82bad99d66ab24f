#!/usr/bin/env python3
"""Draws the charts of docs/benchmarks.md from the CSV file that `soup-bench run` writes, as SVG and PNG.

Needs matplotlib (Debian: python3-matplotlib). A chart whose measurements are not in the file is left out.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
import os
import re
import statistics
import sys
from collections import Counter, defaultdict
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Callable, Iterable, NamedTuple, NoReturn, Sequence

try:
    import matplotlib
except ImportError:
    sys.exit("chart.py: matplotlib is missing; install python3-matplotlib")
matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

# Dark to light (luminance 0, 72, 113, 145, 178 of 255), so that the order survives a black and white printer. Markers
# and line styles repeat the distinction.
SHADES = ["#000000", "#1f4e96", "#c2571f", "#58b184", "#bea5d6"]
MARKERS = ["o", "s", "^", "D", "v"]
LINES = [":", "--", "-", "-."]
HATCHES = ["", "////", "....", "\\\\\\\\", "xxxx", "----", "oo", "||||", "++"]
GREY = "#777777"
# Names of the options that are ablations, in the order of the chart.
ABLATIONS = [
    "full", "nothing painted", "vertices never rest", "errors pull alike", "one exposure", "no backdrop",
    "pixels at their centres", "no coarse to fine", "opaque", "finest level only", "points for a start",
    "random start", "as published"]
QUALITIES = {"psnr": "PSNR [dB]", "ssim": "SSIM"}
# What --measure draws as fields psnr and ssim of a Row: columns and their labels; more is better. Only records of
# models have columns other than these two.
MEASURES = {
    "ssim": {"psnr": "PSNR [dB]", "ssim": "SSIM"},
    "ms_ssim": {"psnr": "PSNR [dB]", "ms_ssim": "MS-SSIM"},
    "flip": {"psnr": "PSNR [dB]", "flip": "1 - FLIP"},
    "lpips": {"psnr": "PSNR [dB]", "lpips": "1 - LPIPS"},
    "covisible": {"psnr_covisible": "PSNR [dB], co-visible", "ssim_covisible": "SSIM, co-visible"}}
MIN_SHARE = 0.03  # of a step; kernels below it are drawn together as "others"

plt.rcParams.update({
    "font.size": 8, "axes.labelsize": 8, "axes.titlesize": 8, "xtick.labelsize": 7, "ytick.labelsize": 7,
    "axes.spines.top": False, "axes.spines.right": False, "axes.linewidth": 0.6, "lines.linewidth": 1.0,
    "lines.markersize": 3.5, "axes.grid": True, "grid.linewidth": 0.3, "grid.color": "#cccccc",
    "axes.axisbelow": True, "hatch.linewidth": 0.4, "figure.dpi": 100, "savefig.dpi": 200, "svg.fonttype": "none",
    "svg.hashsalt": "trisoup", "font.family": "DejaVu Sans"})

NUMBERS = [
    "resolution", "budget", "steps", "seed", "step", "seconds", "cpu_seconds", "triangles", "psnr", "ssim", "mae",
    "bytes", "frame_ms", "views", "size", "kernel_ms"]
TEXTS = [
    "record", "scene", "options", "command", "kernel", "frame_size", "frame_device", "device", "driver", "date",
    "revision", "settings"]
# Numbers that a record of each kind must have. Quality may be missing: a dataset need not have test views.
NEEDED = {
    "evaluation": ["budget", "steps", "seed", "step", "seconds", "cpu_seconds"],
    "model": ["budget", "steps", "seed", "triangles", "bytes"],
    "frame": ["frame_ms"],
    "step": ["triangles", "views", "size", "kernel_ms"],
    "kernel": ["kernel_ms"]}

# Settings that have other names in results of earlier versions.
EARLIER_NAMES = {
    "rate_texture": "lr_texture", "rate_mlp": "lr_mlp", "rate_vertex": "lr_vertex", "rate_end": "lr_end",
    "rate_vertex_end": "lr_vertex_end", "resample_every": "refine_every", "resample_until": "refine_until"}
NUMERIC_SETTINGS = ("lr_vertex", "lr_end", "lr_vertex_end", "rest_share", "steps", "seed")
REST_SHARE = 0.2  # last share of a training from a surface, in which the vertex rate also falls to zero


@dataclass(frozen=True)
class Row:
    """A record of the CSV file. Numbers that are empty there are NaN; NEEDED says which are not."""

    record: str
    scene: str
    options: str
    command: str
    kernel: str
    frame_size: str
    revision: str
    resolution: float
    budget: float
    steps: float
    seed: float
    step: float
    seconds: float
    cpu_seconds: float
    triangles: float
    psnr: float
    ssim: float
    bytes: float
    frame_ms: float
    views: float
    size: float
    kernel_ms: float
    settings: dict[str, Any] = field(compare=False, hash=False)

    def number(self, column: str) -> float:
        return getattr(self, column)

    def has(self, *columns: str) -> bool:
        """Whether numbers are not empty."""
        return not any(math.isnan(self.number(column)) for column in columns)

    @property
    def scene_name(self) -> str:
        """Name of the scene and its resolution: qualities at different resolutions cannot be compared."""
        suffix = f" at 1/{self.resolution:g} resolution" if self.has("resolution") and self.resolution != 1 else ""
        return self.scene + suffix


class Training(NamedTuple):
    """Scene, budget and steps of trainings that are drawn as one curve."""

    scene: str
    budget: float
    steps: float


class Group(NamedTuple):
    """Trainings that differ in nothing but the settings that a chart is about; `settings` are the others."""

    scene: str
    budget: float
    steps: float
    settings: str


class Label(NamedTuple):
    """A label for the end (x, y) of a curve."""

    x: float
    y: float
    text: str
    colour: str


class Point(NamedTuple):
    """A point of a curve, with the look of its marker."""

    cost: float
    quality: float
    colour: str
    marker: str


def warn(line: str) -> None:
    print(f"chart.py: {line}", file=sys.stderr)


# Reading.


def read(path: str, measure: str = "ssim") -> list[Row]:
    """measure: of MEASURES; Row.psnr and Row.ssim hold its columns."""
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file, strict=True)
            missing = [c for c in NUMBERS + TEXTS if c not in (reader.fieldnames or [])]
            if missing:
                raise ValueError(f"{path}: has no column '{missing[0]}'; it is not a file of soup-bench run")
            absent = [c for c in MEASURES[measure] if c not in (reader.fieldnames or [])]
            if absent:
                raise ValueError(f"{path}: has no column '{absent[0]}'; measure again with this version")
            return [read_row(f"{path}: record {number}", with_measure(record, measure))
                    for number, record in enumerate(reader, 1)]
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{path}: is not the CSV of soup-bench run ({error})") from None


def with_measure(record: dict[str, str], measure: str) -> dict[str, str]:
    """The record with the measure in columns psnr and ssim; values that are no numbers stay, for read_row."""
    psnr, text = (record.get(column) or "" for column in MEASURES[measure])
    if measure in ("flip", "lpips") and re.fullmatch(r"\d+(\.\d+)?(e-\d+)?", text):
        text = f"{1 - float(text):.6f}"
    return {**record, "psnr": psnr, "ssim": text}


def read_row(where: str, record: dict[str, str]) -> Row:
    if None in record or None in record.values():
        raise ValueError(f"{where} has more or fewer values than there are columns; remove it")
    numbers = {column: read_number(where, column, record[column]) for column in NUMBERS}
    empty = [c for c in NEEDED.get(record["record"], []) if math.isnan(numbers[c])]
    if empty:
        kind = record["record"]
        raise ValueError(f"{where}: column {empty[0]} is empty in a row of kind '{kind}'; remove the record")
    settings = read_settings(where, record["settings"]) if record["record"] == "model" else {}
    fields = Row.__dataclass_fields__
    texts = {column: record[column] for column in TEXTS if column in fields and column != "settings"}
    return Row(settings=settings, **texts, **{c: n for c, n in numbers.items() if c in fields})


def read_number(where: str, column: str, text: str) -> float:
    if not text:
        return math.nan
    least = -1 if column == "ssim" else 0
    try:
        value = float(text)
        if least <= value < math.inf:
            return value
    except ValueError:
        pass
    raise ValueError(f"{where}: '{text}' in column {column} is not a number from {least} on; remove the record")


def read_settings(where: str, text: str) -> dict[str, Any]:
    try:
        settings = json.loads(text) if text else {}
    except json.JSONDecodeError:
        settings = None
    if isinstance(settings, dict):
        settings = {EARLIER_NAMES.get(name, name): value for name, value in settings.items()}
        if all(isinstance(settings.get(name, 0), (int, float)) for name in NUMERIC_SETTINGS):
            return settings
    raise ValueError(f"{where}: column settings is not a JSON object of settings; remove the record")


# Drawing.


def escaped(text: str) -> str:
    """Text for matplotlib, which reads text between dollars as mathematics."""
    return text.replace("$", r"\$")


def short(count: float) -> str:
    """15000 -> 15K"""
    return f"{count / 1000:g}K" if count >= 1000 else f"{count:g}"


def describe(budget: float, steps: float) -> str:
    return f"{short(budget)} triangles, {short(steps)} steps"


def styles(values: Iterable[float], choices: list[str]) -> dict[float, str]:
    """A style for each value, in order."""
    return {v: choices[i % len(choices)] for i, v in enumerate(sorted(values))}


def spread(places: Sequence[float], gap: float) -> list[float]:
    """Ascending places in 0..1, moved apart until neighbours have a gap."""
    moved = list(places)
    for _ in range(500):
        overlapped = False
        for i in range(len(moved) - 1):
            overlap = gap - (moved[i + 1] - moved[i])
            if overlap > 1e-4:
                moved[i] -= overlap / 2
                moved[i + 1] += overlap / 2
                overlapped = True
        if not overlapped:
            break
    if moved and moved[-1] > 1:
        moved = [min(p, 1 - gap * (len(moved) - 1 - i)) for i, p in enumerate(moved)]
    if moved and moved[0] < 0:
        moved = [max(p, gap * i) for i, p in enumerate(moved)]
    return moved


def label_at_right(axes: Axes, labels: list[Label]) -> None:
    """Writes labels beside the axes, one below the other, each with a line to its point."""
    if not labels:
        return
    figure = axes.figure
    figure.draw_without_rendering()  # lays the axes out
    font_size = plt.rcParams["xtick.labelsize"]
    gap = 1.25 * font_size * figure.dpi / 72 / axes.get_window_extent().height
    smaller = min(1, 1 / (gap * len(labels)))  # if they do not fit

    def height(label: Label) -> float:
        return axes.transAxes.inverted().transform(axes.transData.transform((label.x, label.y)))[1]
    ordered = sorted(labels, key=height)
    for place, label in zip(spread([height(label) for label in ordered], gap * smaller), ordered):
        line = {"arrowstyle": "-", "lw": 0.35, "relpos": (0, 0.5), "color": "#888888", "shrinkB": 2, "shrinkA": 0}
        axes.annotate(
            label.text, (label.x, label.y), xytext=(1.05, place), textcoords="axes fraction",
            fontsize=smaller * font_size, va="center", color=label.colour, annotation_clip=False, arrowprops=line)


def logarithmic(axes: Axes) -> None:
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda v, _: short(v)))
    axes.xaxis.set_minor_formatter(NullFormatter())


def pareto(points: Iterable[Point]) -> list[Point]:
    """The points that no other point beats in both cost and quality, by cost."""
    front: list[Point] = []
    for p in sorted(points, key=lambda p: (p.cost, -p.quality)):
        if not front or p.quality > front[-1].quality:
            front.append(p)
    return front


# Trainings with the full method.


def full_trainings(rows: list[Row], record: str) -> dict[Training, list[Row]]:
    """Rows of trainings with the full method, of the first seed."""
    found: dict[Training, dict[str, list[Row]]] = defaultdict(dict)
    for r in rows:
        if r.record == record and r.options == "full" and r.has("psnr", "ssim"):
            found[Training(r.scene_name, r.budget, r.steps)].setdefault(r.command, []).append(r)
    chosen = {}
    for training, commands in sorted(found.items()):
        by_seed = sorted(commands.values(), key=lambda c: (c[0].seed, c[0].command))
        chosen[training] = by_seed[0]
        same = [c[0].command for c in by_seed if c[0].seed == by_seed[0][0].seed]
        if len(same) > 1:
            warn(f"{len(same)} trainings are called 'full' with {training.scene}, "
                 f"{describe(training.budget, training.steps)}; only this one is drawn: {same[0]}")
    return chosen


def quality_over_time(rows: list[Row], time: str) -> Figure | None:
    """time: the column of the time axis."""
    curves = full_trainings(rows, "evaluation")
    scenes = list(dict.fromkeys(training.scene for training in curves))
    if not scenes:
        return None
    n = len(scenes)
    figure, grid = plt.subplots(2, n, figsize=(4.2 * n, 5.2), squeeze=False, sharex="col")
    figure.subplots_adjust(wspace=0.95, left=0.12 / n, right=1 - 0.36 / n, bottom=0.09, top=0.95, hspace=0.16)
    look = Look({t.budget for t in curves}, {t.steps for t in curves})
    for column, scene in enumerate(scenes):
        of_scene = {training: points for training, points in sorted(curves.items()) if training.scene == scene}
        started = math.inf
        for axes, quality in zip(grid[:, column], QUALITIES):
            points, labels = draw_curves(axes, of_scene, time, quality, look)
            draw_front(axes, points)
            logarithmic(axes)
            lowest = frame_ends(axes, points, labels, quality)
            started = min([started, *(p.cost for p in points if p.quality >= lowest)])
            axes.set_xlim(left=0.8 * started)
            axes.set_ylabel(QUALITIES[quality])
            if quality == "psnr":
                axes.set_title(escaped(scene), loc="left")
                axes.tick_params(labelbottom=False)
            else:
                is_cpu = time == "cpu_seconds"
                axes.set_xlabel("training time [CPU seconds, all threads]" if is_cpu else "training time [s]")
            label_at_right(axes, labels)
    return figure


class Look:
    """Colours and markers by budget, line styles by steps."""

    def __init__(self, budgets: set[float], steps: set[float]) -> None:
        self.shade, self.marker = styles(budgets, SHADES), styles(budgets, MARKERS)
        self.line = styles(steps, LINES)


def draw_curves(axes: Axes, curves: dict[Training, list[Row]], time: str, quality: str,
                look: Look) -> tuple[list[Point], list[Label]]:
    points: list[Point] = []
    labels: list[Label] = []
    for (_, budget, steps), rows in curves.items():
        ordered = sorted(rows, key=lambda r: r.step)
        shade, marker = look.shade[budget], look.marker[budget]
        curve = [Point(r.number(time), r.number(quality), shade, marker) for r in ordered]
        axes.plot([p.cost for p in curve], [p.quality for p in curve], color=shade, ls=look.line[steps], lw=0.9,
                  marker=marker, ms=2.6, mfc="white", mew=0.6, zorder=3)
        labels.append(Label(curve[-1].cost, curve[-1].quality, describe(budget, steps), shade))
        points += curve
    return points, labels


def draw_front(axes: Axes, points: list[Point]) -> None:
    front = pareto(points)
    axes.plot([p.cost for p in front], [p.quality for p in front], color="#cccccc", lw=4, drawstyle="steps-post",
              solid_joinstyle="round", zorder=1)
    for p in front:
        axes.plot(p.cost, p.quality, marker=p.marker, ms=4, color=p.colour, zorder=4)


def frame_ends(axes: Axes, points: list[Point], labels: list[Label], quality: str) -> float:
    """Sets the range of quality so that the ends of curves are seen; their first steps may lie below. Returns its lower
    limit."""
    best, worst = max(p.quality for p in points), min(label.y for label in labels)
    worst = min(worst, best - (3 if quality == "psnr" else 0.1))
    margin = 0.1 * (best - worst)
    axes.set_ylim(worst - margin, best + margin)
    return worst - margin


class Cost(NamedTuple):
    """An axis of costs of a model: its column, unit and label."""

    column: str
    unit: float
    label: str


def quality_over_cost(rows: list[Row], scene: str) -> Figure | None:
    trained = {t: r[0] for t, r in full_trainings(rows, "model").items() if t.scene == scene}
    if len({t.budget for t in trained}) < 2:
        return None
    models, costs = with_frame_times(rows, scene, trained)
    all_steps = sorted({t.steps for t in models})
    shade, marker, line = (styles(all_steps, choices) for choices in (SHADES, MARKERS, LINES))
    figure, grid = plt.subplots(2, len(costs), figsize=(2.7 * len(costs), 4.4), squeeze=False, sharey="row")
    figure.subplots_adjust(wspace=0.12, left=0.07, right=0.86, bottom=0.1, top=0.94, hspace=0.14)
    for row, quality in enumerate(QUALITIES):
        for column, cost in enumerate(costs):
            axes = grid[row][column]
            labels = []
            for steps in all_steps:
                points = sorted(((m.number(cost.column) * cost.unit, m.number(quality)) for t, m in models.items()
                                 if t.steps == steps and m.number(cost.column) > 0), key=lambda p: p[0])
                if not points:
                    continue
                axes.plot(*zip(*points), color=shade[steps], ls=line[steps], marker=marker[steps], mfc="white", mew=0.8)
                labels.append(Label(*points[-1], f"{short(steps)} steps", shade[steps]))
            logarithmic(axes)
            if column == 0:
                axes.set_ylabel(QUALITIES[quality])
            if row == 0:
                axes.tick_params(labelbottom=False)
                if column == 0:
                    axes.set_title(escaped(scene), loc="left")
            else:
                axes.set_xlabel(cost.label)
            if column == len(costs) - 1:
                label_at_right(axes, labels)
    return figure


def with_frame_times(rows: list[Row], scene: str,
                     models: dict[Training, Row]) -> tuple[dict[Training, Row], list[Cost]]:
    """Models with the times of their frames, at the frame size that most of them have, and the costs to draw."""
    times = {(r.command, r.frame_size): r.frame_ms for r in rows if r.record == "frame"}
    commands = {m.command for m in models.values()}
    sizes = Counter(size for command, size in times if command in commands)
    size = max(sorted(sizes), key=lambda s: sizes[s], default="")
    if len(sizes) > 1:
        warn(f"{scene}: frames of several sizes; only those of {size} are drawn")
    timed = {t: replace(m, frame_ms=times.get((m.command, size), math.nan)) for t, m in models.items()}
    costs = [Cost("triangles", 1, "triangles"), Cost("bytes", 1e-6, "model file [MB]")]
    if any(m.frame_ms > 0 for m in timed.values()):
        costs.append(Cost("frame_ms", 1, f"time of a picture of {size.replace('x', ' x ')} [ms]"))
    return timed, costs


# Ablations.

Ablations = dict[str, dict[float, Row]]  # rows by option and seed


def ablations(rows: list[Row]) -> Figure | None:
    """Trainings with at least two of ABLATIONS: a dot for each seed, their mean and range."""
    found = find_ablations(rows)
    if not found:
        return None
    n = len(found)
    figure, grid = plt.subplots(n, 2, figsize=(7.2, 0.7 + 1.7 * n), squeeze=False)
    figure.subplots_adjust(left=0.19, right=0.98, wspace=0.12, hspace=0.5, bottom=0.3 / (0.5 + n),
                           top=1 - 0.2 / (0.5 + n))
    for row, ((scene, budget, steps), options) in enumerate(found.items()):
        names = [name for name in ABLATIONS if name in options]
        seeds = sorted(common_seeds(options))  # the same for all options
        for axes, quality in zip(grid[row], QUALITIES):
            for i, name in enumerate(names):
                draw_values(axes, i, [options[name][seed].number(quality) for seed in seeds], quality)
            axes.set_ylim(len(names) - 0.5, -0.5)
            axes.set_yticks(range(len(names)), names if quality == "psnr" else [""] * len(names))
            axes.grid(axis="y", visible=False)
            axes.margins(x=0.16)
            axes.xaxis.set_major_locator(MaxNLocator(6))
            if quality == "psnr":
                count = f"{len(seeds)} seed{'s' if len(seeds) > 1 else ''}"
                axes.set_title(escaped(f"{scene}, {describe(budget, steps)}, {count}"), loc="left")
            if row == n - 1:
                axes.set_xlabel(QUALITIES[quality])
    return figure


def common_seeds(options: Ablations) -> set[float]:
    return set.intersection(*(set(seeds) for seeds in options.values()))


def find_ablations(rows: list[Row]) -> dict[Training, Ablations]:
    found: dict[Training, Ablations] = defaultdict(lambda: defaultdict(dict))
    for r in rows:
        if r.record == "model" and r.has("psnr", "ssim") and r.options in ABLATIONS:
            found[Training(r.scene_name, r.budget, r.steps)][r.options][r.seed] = r
    compared = {}
    for training, options in sorted(found.items()):
        if len(options) < 2:
            continue
        if common_seeds(options):
            compared[training] = options
        else:
            warn(f"no seed is common to the ablations of {training.scene}, "
                 f"{describe(training.budget, training.steps)}; left out")
    return compared


def draw_values(axes: Axes, y: int, values: list[float], quality: str) -> None:
    """One ablation: values of all seeds, their range and mean."""
    mean = statistics.fmean(values)
    axes.plot([min(values), max(values)], [y, y], color=GREY, lw=1)
    axes.plot(values, [y] * len(values), "o", mfc="white", mec="black", ms=4, mew=0.7)
    axes.plot(mean, y, "|", color="black", ms=9, mew=1.8)
    axes.annotate(f"{mean:.2f}" if quality == "psnr" else f"{mean:.3f}", (max(values), y), xytext=(6, 0),
                  textcoords="offset points", va="center", fontsize=7)


# Learning rates.

RATE_SETTINGS = ("lr_vertex", "lr_end", "lr_vertex_end", "seed")


def rest_share(settings: dict[str, Any]) -> float:
    """The last share of a training in which the vertex rate also falls linearly to zero. Earlier versions record it as
    a setting, or have none; results of today's version have the setting `published`."""
    rests = "published" in settings and not settings["published"] and settings.get("init") == "surface"
    return settings.get("rest_share", REST_SHARE if rests else 0)


def sum_of_rates(settings: dict[str, Any]) -> float:
    """The sum of the vertex learning rates over all steps. The rate falls exponentially to the share `end`."""
    end, rest = settings.get("lr_vertex_end", settings["lr_end"]), rest_share(settings)
    times = [(i + 0.5) / 1000 for i in range(1000)]
    falling = sum(end ** t * min(1, (1 - t) / rest if rest else 1) for t in times)
    return settings["lr_vertex"] * settings["steps"] * falling / 1000


class RatePoint(NamedTuple):
    sum_of_rates: float
    psnr: float


def find_rates(rows: list[Row]) -> dict[Group, dict[float, list[RatePoint]]]:
    """Points by group and by the final share of the rate, of the first seed."""
    found: dict[Group, dict[float, dict[float, list[RatePoint]]]] = defaultdict(
        lambda: defaultdict(lambda: defaultdict(list)))
    for r in rows:
        s = r.settings
        if r.record != "model" or not r.has("psnr") or not {"lr_vertex", "lr_end", "steps", "seed"} <= s.keys():
            continue
        if 0 < s["lr_end"] <= 1:
            group = group_of(r, RATE_SETTINGS)
            end = s.get("lr_vertex_end", s["lr_end"])
            found[group][end][s["seed"]].append(RatePoint(sum_of_rates(s), r.psnr))
    groups = {}
    for group, by_end in sorted(found.items()):
        of_first_seed = {end: by_seed[min(by_seed)] for end, by_seed in by_end.items()}
        if len({p.sum_of_rates for points in of_first_seed.values() for p in points}) > 2:
            groups[group] = of_first_seed
    return groups


def group_of(r: Row, varied: tuple[str, ...]) -> Group:
    """The group of a training: all settings but those that the chart varies."""
    same = json.dumps({k: v for k, v in r.settings.items() if k not in varied}, sort_keys=True)
    return Group(r.scene_name, r.budget, r.steps, same)


def quality_over_rate(rows: list[Row]) -> Figure | None:
    """PSNR over the sum of the vertex learning rates, of trainings that differ in nothing but these rates."""
    groups = find_rates(rows)
    if not groups:
        return None
    scenes = list(dict.fromkeys(group.scene for group in groups))
    ends = {end for by_end in groups.values() for end in by_end}
    line, marker, shade = (styles(ends, choices) for choices in (LINES, MARKERS, SHADES))
    fill = styles({group.steps for group in groups}, ["white", "#bbbbbb", "black"])
    n = len(scenes)
    figure, grid = plt.subplots(1, n, figsize=(4.6 * n, 2.9), squeeze=False)
    figure.subplots_adjust(wspace=1.15, left=0.11 / n, right=1 - 0.42 / n, bottom=0.16, top=0.92)
    for axes, scene in zip(grid[0], scenes):
        labels = []
        for (of, budget, steps, _), by_end in groups.items():
            for end, unordered in sorted(by_end.items()) if of == scene else []:
                points = sorted(unordered)
                axes.plot([p.sum_of_rates for p in points], [p.psnr for p in points], color=shade[end], ls=line[end],
                          lw=0.9, marker=marker[end], ms=3.2, mew=0.7, mfc=fill[steps])
                labels.append(Label(*points[-1], f"{describe(budget, steps)}, to {100 * end:g} %", shade[end]))
        logarithmic(axes)
        axes.set_xlabel("sum of vertex learning rates [normalised units]")
        axes.set_ylabel(QUALITIES["psnr"])
        axes.set_title(escaped(scene), loc="left")
        label_at_right(axes, labels)
    return figure


# Model size.


class Series(NamedTuple):
    """The look of a series of models, and of the values beside its points."""

    name: str
    label: str
    colour: str
    line: str
    marker: str
    value: str  # format
    offset: int  # of the value above its point


KNEE_SERIES = [
    Series("knee", "--knee", "black", "-", "o", "{:g} dB", 6),
    Series("uniform", "uniform: samples for each pixel", GREY, "--", "s", "{:g}", -11)]

ByValue = dict[float, Row]


def find_knees(rows: list[Row]) -> dict[Group, dict[str, ByValue]]:
    """Models by the value of --knee, and without a knee by the samples for each pixel ("uniform")."""
    found: dict[Group, dict[str, ByValue]] = defaultdict(lambda: {series.name: {} for series in KNEE_SERIES})
    for r in rows:
        s = r.settings
        if r.record != "model" or not r.has("psnr", "ssim", "bytes") or not {"knee", "samples_per_pixel"} <= s.keys():
            continue
        series = found[group_of(r, ("knee", "samples_per_pixel"))]
        if s["samples_per_pixel"] == 1:
            series["knee"][s["knee"]] = r
        if s["knee"] == 0:
            series["uniform"][s["samples_per_pixel"]] = r
    return {group: series for group, series in sorted(found.items()) if len(series["knee"]) > 2}


def quality_over_knee(rows: list[Row]) -> Figure | None:
    """Quality over bytes, of trainings that differ in nothing but --knee, or without a knee in the samples for each
    pixel."""
    found = find_knees(rows)
    if not found:
        return None
    figure, grid = plt.subplots(2, len(found), figsize=(4.2 * len(found), 4.6), squeeze=False)
    figure.subplots_adjust(left=0.09, right=0.97, wspace=0.24, bottom=0.1, top=0.94, hspace=0.12)
    for column, ((scene, budget, steps, _), by_series) in enumerate(found.items()):
        for axes, quality in zip(grid[:, column], QUALITIES):
            for series in KNEE_SERIES:
                draw_series(axes, series, by_series[series.name], quality)
            logarithmic(axes)
            axes.margins(y=0.12)
            if column == 0:
                axes.set_ylabel(QUALITIES[quality])
        name_size_axes(grid[:, column], f"{scene}, {describe(budget, steps)}")
    grid[0][0].legend(loc="lower right", fontsize=7, frameon=False)
    return figure


def draw_series(axes: Axes, series: Series, models: ByValue, quality: str) -> None:
    points = sorted((r.bytes * 1e-6, r.number(quality), value) for value, r in models.items())
    axes.plot([p[0] for p in points], [p[1] for p in points], color=series.colour, ls=series.line,
              marker=series.marker, mfc="white", mew=0.8, label=series.label)
    for x, y, value in points:
        axes.annotate(series.value.format(value), (x, y), xytext=(0, series.offset), textcoords="offset points",
                      ha="center", fontsize=6, color=series.colour)


def name_size_axes(column: Sequence[Axes], title: str) -> None:
    """Title and x axis of two charts of quality over bytes, one above the other."""
    above, below = column
    above.set_title(escaped(title), loc="left")
    above.tick_params(labelbottom=False)
    below.set_xlabel("model file [MB]")


class Sized(NamedTuple):
    """A model. value: its goal as text, or the samples for each pixel."""

    megabytes: float
    psnr: float
    ssim: float
    value: Any


@dataclass
class Goals:
    """Models that were trained to reach a goal, and models without goal and knee."""

    goal: list[Sized] = field(default_factory=list)
    uniform: list[Sized] = field(default_factory=list)


def find_goals(rows: list[Row]) -> dict[str, Goals]:
    found: dict[str, Goals] = defaultdict(Goals)
    for r in rows:
        s = r.settings
        if r.record != "model" or not r.has("psnr", "ssim", "bytes"):
            continue
        if not {"knee", "target_psnr", "samples_per_pixel"} <= s.keys():
            continue
        if s["target_psnr"] > 0:
            found[r.scene_name].goal.append(Sized(r.bytes * 1e-6, r.psnr, r.ssim, f"{s['target_psnr']:g} dB"))
        elif s["knee"] == 0:
            found[r.scene_name].uniform.append(Sized(r.bytes * 1e-6, r.psnr, r.ssim, s["samples_per_pixel"]))
    return {scene: goals for scene, goals in sorted(found.items()) if len(goals.goal) > 2}


def quality_over_goals(rows: list[Row]) -> Figure | None:
    """Quality over bytes, of trainings with a PSNR as goal, and of trainings of the same scene without goal and
    knee."""
    found = find_goals(rows)
    if not found:
        return None
    figure, grid = plt.subplots(2, len(found), figsize=(3.3 * len(found) + 0.5, 4.6), squeeze=False)
    figure.subplots_adjust(left=0.07, right=0.98, wspace=0.26, bottom=0.1, top=0.94, hspace=0.12)
    for column, (scene, goals) in enumerate(found.items()):
        for axes, quality in zip(grid[:, column], QUALITIES):
            draw_goals(axes, goals, quality)
            logarithmic(axes)
            axes.margins(x=0.12, y=0.12)
            if column == 0:
                axes.set_ylabel(QUALITIES[quality])
        name_size_axes(grid[:, column], scene)
    grid[0][-1].legend(loc="lower right", fontsize=6, frameon=False)
    return figure


def draw_goals(axes: Axes, goals: Goals, quality: str) -> None:
    with_goal = sorted(goals.goal)
    axes.plot([p.megabytes for p in with_goal], [getattr(p, quality) for p in with_goal], color="black", marker="o",
              mfc="white", mew=0.8, label="--target-psnr")
    all_samples = sorted({p.value for p in goals.uniform}, reverse=True)
    for samples, marker in zip(all_samples, ["s", "v", "D", "^"]):
        points = sorted(p for p in goals.uniform if p.value == samples)
        axes.plot([p.megabytes for p in points], [getattr(p, quality) for p in points], color=GREY, ls="--", lw=0.8,
                  marker=marker, ms=3.5, mfc="white", mew=0.8, label=f"uniform, samples for each pixel: {samples:g}")
    for p in with_goal if quality == "psnr" else []:
        axes.annotate(p.value, (p.megabytes, p.psnr), xytext=(-3, 5), textcoords="offset points", ha="right",
                      fontsize=6)


# Time of a step.


class Measured(NamedTuple):
    """A measurement of steps: the side of the views in pixels, triangles, and views."""

    size: float
    triangles: float
    views: float


class Panel(NamedTuple):
    """Measurements that differ in one quantity: size or triangles."""

    over_size: bool
    measured: list[Measured]


Times = dict[Measured, dict[str, float]]  # ms by kernel
KeyFunction = Callable[[Measured], tuple[float, float]]


def step_panels(times: Times) -> list[Panel]:
    """The largest set of measurements with the same triangles, and with the same size."""
    same_triangles: KeyFunction = lambda m: (m.triangles, m.views)
    same_size: KeyFunction = lambda m: (m.size, m.views)
    panels = []
    for over_size, key in ((True, same_triangles), (False, same_size)):
        groups: dict[tuple[float, float], list[Measured]] = defaultdict(list)
        for measured in times:
            groups[key(measured)].append(measured)
        best = max(groups.values(), key=len, default=[])
        if len(best) > 1:
            panels.append(Panel(over_size, sorted(best)))
    return panels


def shares_of_kernels(times: Times, panels: list[Panel]) -> Counter[str]:
    """The largest share of a step that each kernel has."""
    shares: Counter[str] = Counter()
    for panel in panels:
        for measured in panel.measured:
            total = sum(times[measured].values())
            for kernel, ms in times[measured].items():
                shares[kernel] = max(shares[kernel], ms / total)
    return shares


def step_by_kernel(rows: list[Row]) -> Figure | None:
    """Time of a step by kernel, stacked: over pixels and over triangles."""
    times: Times = defaultdict(dict)
    for r in rows:
        if r.record == "step":
            times[Measured(r.size, r.triangles, r.views)][r.kernel] = r.kernel_ms
    panels = step_panels(times)
    if not panels:
        return None
    shares = shares_of_kernels(times, panels)
    shown = [kernel for kernel, share in shares.most_common() if share >= MIN_SHARE]
    others = [kernel for kernel in shares if kernel not in shown]
    figure, grid = plt.subplots(1, len(panels), figsize=(4.1 * len(panels), 3.4), squeeze=False)
    figure.subplots_adjust(left=0.08, right=0.87, wspace=0.95, bottom=0.14, top=0.91)
    for axes, panel in zip(grid[0], panels):
        stack = {kernel: [times[m].get(kernel, 0) for m in panel.measured] for kernel in shown}
        if others:
            stack["others"] = [sum(times[m].get(kernel, 0) for kernel in others) for m in panel.measured]
        draw_stack(axes, panel, stack)
    return figure


def draw_stack(axes: Axes, panel: Panel, stack: dict[str, list[float]]) -> None:
    if panel.over_size:
        x = [m.size ** 2 * m.views / 1e6 for m in panel.measured]
    else:
        x = [m.triangles / 1e3 for m in panel.measured]
    below = [0.0] * len(x)
    labels = []
    for i, (layer, values) in enumerate(stack.items()):
        above = [b + v for b, v in zip(below, values)]
        grey = 0.97 - 0.45 * (i % 3) / 2
        axes.fill_between(x, below, above, facecolor=str(grey), edgecolor="black", lw=0.5,
                          hatch=HATCHES[i % len(HATCHES)])
        text = f"{layer} {values[-1]:.0f}" if values[-1] >= 10 else f"{layer} {values[-1]:.1f}"
        labels.append(Label(x[-1], (below[-1] + above[-1]) / 2, text, "black"))
        below = above
    axes.plot(x, below, "o-", color="black", ms=3, lw=1)
    axes.set_xlim(0, x[-1])
    axes.set_ylim(0, 1.02 * below[-1])
    axes.set_ylabel("time of a step [ms]")
    size, triangles, views = panel.measured[0]
    if panel.over_size:
        axes.set_xlabel("pixels of a step [millions]")
        axes.set_title(f"{short(triangles)} triangles, {views:g} views", loc="left")
    else:
        axes.set_xlabel("triangles [thousands]")
        axes.set_title(f"{views:g} views of {size:g} x {size:g}", loc="left")
    label_at_right(axes, labels)


# Output.


def save(figure: Figure, path: Path, metadata: dict[str, None]) -> None:
    """Writes a picture. A file of that name is always complete."""
    beside = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        figure.savefig(beside, metadata=metadata, bbox_inches="tight", pad_inches=0.04)
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)


def draw_all(rows: list[Row], time: str) -> dict[str, Figure | None]:
    """All charts by name; None: no measurements."""
    figures = {
        "quality_over_time": quality_over_time(rows, time),
        "ablations": ablations(rows),
        "quality_over_rate": quality_over_rate(rows),
        "quality_over_knee": quality_over_knee(rows),
        "quality_over_goals": quality_over_goals(rows),
        "step_by_kernel": step_by_kernel(rows)}
    for scene in dict.fromkeys(r.scene_name for r in rows if r.record == "model"):
        name = "quality_over_cost_" + re.sub(r"\W+", "_", scene)
        while name in figures:  # for scenes such as "a b" and "a_b"
            name += "_"
        figures[name] = quality_over_cost(rows, scene)
    return figures


def save_all(figures: dict[str, Figure | None], folder: Path) -> int:
    """Returns the number of charts."""
    folder.mkdir(parents=True, exist_ok=True)
    drawn = 0
    for name, figure in figures.items():
        if figure is None:
            print(f"{name}: not measured, left out")
            continue
        save(figure, folder / f"{name}.svg", {"Date": None})
        save(figure, folder / f"{name}.png", {"Software": None})
        drawn += 1
    return drawn


class OneLineParser(argparse.ArgumentParser):
    """Prints errors in one line."""

    def error(self, message: str) -> NoReturn:
        sys.exit(f"chart.py: {message}; see --help")


def main() -> None:
    parser = OneLineParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("results", help="CSV file of soup-bench run")
    parser.add_argument("-o", "--output", required=True, help="folder for the charts")
    parser.add_argument("--time", choices=["cpu", "wall"], default="wall",
                        help="axis of training time: seconds (wall), or CPU seconds of all threads (cpu), which depend "
                             "less on other programs [wall]")
    parser.add_argument("--measure", choices=list(MEASURES), default="ssim",
                        help="drawn beside PSNR; covisible: PSNR and SSIM of co-visible pixels [ssim]")
    arguments = parser.parse_args()
    QUALITIES.update(zip(QUALITIES, MEASURES[arguments.measure].values()))
    try:
        rows = read(arguments.results, arguments.measure)
        revisions = sorted({r.revision for r in rows if r.record in ("evaluation", "model")})
        if len(revisions) > 1:
            warn(f"{arguments.results}: has trainings of {len(revisions)} revisions of the program "
                 f"({', '.join(revisions)})")
        figures = draw_all(rows, "cpu_seconds" if arguments.time == "cpu" else "seconds")
        if save_all(figures, Path(arguments.output)) == 0:
            raise ValueError(f"{arguments.results}: holds nothing to draw")
    except OSError as error:
        sys.exit(f"chart.py: {error.filename or arguments.results}: {error.strerror}; check the path")
    except ValueError as error:
        sys.exit(f"chart.py: {error}")


if __name__ == "__main__":
    main()
