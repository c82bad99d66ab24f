#!/usr/bin/env python3
"""Draws the charts of docs/benchmarks.md from what `soup-bench run` has measured, as SVG and PNG.

Needs matplotlib (Debian: python3-matplotlib). Everything comes from the CSV file; a chart whose measurements are not in it is left out.
"""

import argparse
import collections
import csv
import json
import math
import os
import pathlib
import re
import statistics
import sys

try:
    import matplotlib
except ImportError:
    sys.exit("chart.py: matplotlib is missing; install python3-matplotlib")
matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter

# Dark to light (luminance 0, 72, 113, 145, 178 of 255), so that the order survives a black and white printer; markers and line styles say the same again.
SHADES = ["#000000", "#1f4e96", "#c2571f", "#58b184", "#bea5d6"]
MARKERS = ["o", "s", "^", "D", "v"]
LINES = [":", "--", "-", "-."]
HATCHES = ["", "////", "....", "\\\\\\\\", "xxxx", "----", "oo", "||||", "++"]
ABLATIONS = ["full", "nothing painted", "vertices never rest", "errors pull alike", "one exposure", "no backdrop", "pixels at their centres",
             "no coarse to fine", "opaque", "finest level only", "points for a start", "random start", "as published"]

plt.rcParams.update({
    "font.size": 8, "axes.labelsize": 8, "axes.titlesize": 8, "xtick.labelsize": 7, "ytick.labelsize": 7,
    "axes.spines.top": False, "axes.spines.right": False, "axes.linewidth": 0.6, "lines.linewidth": 1.0, "lines.markersize": 3.5,
    "axes.grid": True, "grid.linewidth": 0.3, "grid.color": "#cccccc", "axes.axisbelow": True, "hatch.linewidth": 0.4,
    "figure.dpi": 100, "savefig.dpi": 200, "svg.fonttype": "none", "svg.hashsalt": "trisoup", "font.family": "DejaVu Sans"})

NUMBERS = ["resolution", "budget", "steps", "seed", "step", "seconds", "cpu_seconds", "triangles", "psnr", "ssim", "mae", "bytes", "frame_ms",
           "views", "size", "kernel_ms"]
TEXTS = ["record", "scene", "options", "command", "kernel", "frame_size", "frame_device", "device", "driver", "date", "revision", "settings"]


# What a row of a record cannot be drawn without. Quality may be missing: a dataset need not have test views.
NEEDED = {"evaluation": ["budget", "steps", "seed", "step", "seconds", "cpu_seconds"], "model": ["budget", "steps", "seed", "triangles", "bytes"],
          "frame": ["frame_ms"], "step": ["triangles", "views", "size", "kernel_ms"], "kernel": ["kernel_ms"]}


def warn(line):
    print(f"chart.py: {line}", file=sys.stderr)


def read(path):
    """Rows as dictionaries, numbers as floats; what is empty is None."""
    rows = []
    try:
        with open(path, newline="", encoding="utf-8-sig") as file:
            reader = csv.DictReader(file, strict=True)
            missing = [c for c in NUMBERS + TEXTS if c not in (reader.fieldnames or [])]
            if missing:
                raise ValueError(f"{path}: has no column '{missing[0]}'; it is not of soup-bench run")
            for number, row in enumerate(reader, 1):
                if None in row or None in row.values():
                    raise ValueError(f"{path}: record {number} has more or fewer values than there are columns; remove it")
                for column in NUMBERS:
                    row[column], text = None, row[column]
                    try:
                        row[column] = float(text) if text else None
                    except ValueError:
                        pass
                    least = -1 if column == "ssim" else 0
                    if text and not (row[column] is not None and least <= row[column] < math.inf):
                        raise ValueError(f"{path}: record {number}: '{text}' in column {column} is not a number from {least} on; remove the record")
                empty = [c for c in NEEDED.get(row["record"], []) if row[c] is None]
                if empty:
                    raise ValueError(f"{path}: record {number}: column {empty[0]} is empty in a row of kind '{row['record']}'; remove the record")
                if row["record"] == "model":
                    row["settings"] = settings_of(path, number, row["settings"])
                rows.append(row)
    except (UnicodeDecodeError, csv.Error) as error:
        raise ValueError(f"{path}: is not the CSV of soup-bench run ({error})") from None
    return rows


def settings_of(path, number, text):
    try:
        settings = json.loads(text) if text else {}
        if isinstance(settings, dict) and all(isinstance(settings.get(k, 0), (int, float)) for k in ("lr_vertex", "lr_end", "steps", "seed")):
            return settings
    except json.JSONDecodeError:
        pass
    raise ValueError(f"{path}: record {number}: column settings is no JSON object of settings; remove the record")


def title(text):
    """matplotlib takes what stands between dollars for mathematics."""
    return text.replace("$", r"\$")


def short(count):
    """15000 -> 15K"""
    return f"{count / 1000:g}K" if count >= 1000 else f"{count:g}"


def label_at_right(axes, ends):
    """Labels beside the axes, one below the other, each with a line to its (x, y). ends: [(x, y, text, colour)]"""
    figure = axes.figure
    figure.canvas.draw()
    height = axes.get_window_extent().height
    gap = 1.25 * plt.rcParams["xtick.labelsize"] * figure.dpi / 72 / height
    smaller = min(1, 1 / (gap * len(ends))) if ends else 1  # where there are more than fit
    gap *= smaller
    to_axes = lambda x, y: axes.transAxes.inverted().transform(axes.transData.transform((x, y)))
    labels = sorted(([*to_axes(x, y), x, y, text, colour] for x, y, text, colour in ends), key=lambda e: e[1])
    places = [e[1] for e in labels]
    for _ in range(500):  # push neighbours apart until none overlap
        moved = False
        for i in range(len(places) - 1):
            overlap = gap - (places[i + 1] - places[i])
            if overlap > 1e-4:
                places[i] -= overlap / 2
                places[i + 1] += overlap / 2
                moved = True
        if not moved:
            break
    if places and places[-1] > 1:
        places = [min(p, 1 - gap * (len(places) - 1 - i)) for i, p in enumerate(places)]
    if places and places[0] < 0:
        places = [max(p, gap * i) for i, p in enumerate(places)]
    for place, (_, _, x, y, text, colour) in zip(places, labels):
        axes.annotate(text, (x, y), xytext=(1.05, place), textcoords="axes fraction", fontsize=smaller * plt.rcParams["xtick.labelsize"], va="center",
                      color=colour, annotation_clip=False, arrowprops={"arrowstyle": "-", "lw": 0.35, "relpos": (0, 0.5), "color": "#888888", "shrinkB": 2, "shrinkA": 0})


def logarithmic(axes, subs=(1.0, 2.0, 5.0)):
    axes.set_xscale("log")
    axes.xaxis.set_major_locator(LogLocator(subs=subs))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda v, _: short(v)))
    axes.xaxis.set_minor_formatter(NullFormatter())


def pareto(points):
    """The points (cost, quality, ...) that none beats in both, by cost."""
    front = []
    for p in sorted(points, key=lambda p: (p[0], -p[1])):
        if not front or p[1] > front[-1][1]:
            front.append(p)
    return front


def scene_name(row):
    """A scene at another resolution is another scene: their qualities do not compare."""
    return row["scene"] + (f" at 1/{row['resolution']:g} resolution" if row["resolution"] not in (None, 1) else "")


def scenes_of(rows):
    return list(dict.fromkeys(scene_name(r) for r in rows))


def styles(values, choices):
    return {v: choices[i % len(choices)] for i, v in enumerate(sorted(values))}


def trainings(rows, record):
    """The full method's rows, of the first seed: {(scene, budget, steps): rows}"""
    found = collections.defaultdict(dict)
    for r in rows:
        if r["record"] == record and r["options"] == "full" and r["psnr"] is not None and r["ssim"] is not None:
            of_command = found[scene_name(r), r["budget"], r["steps"]].setdefault(r["command"], [])
            of_command.append(r)
    chosen = {}
    for key, commands in sorted(found.items()):
        of_seed = sorted(commands.values(), key=lambda c: (c[0]["seed"], c[0]["command"]))
        chosen[key] = of_seed[0]
        same = [c[0]["command"] for c in of_seed if c[0]["seed"] == of_seed[0][0]["seed"]]
        if len(same) > 1:
            warn(f"{len(same)} trainings are called 'full' with {key[0]}, {describe(*key[1:])}; drawn is {same[0]}")
    return chosen


def describe(budget, steps):
    return f"{short(budget)} triangles, {short(steps)} steps"


def quality_over_time(rows, time):
    curves = trainings(rows, "evaluation")
    scenes = list(dict.fromkeys(key[0] for key in curves))
    if not scenes:
        return None
    shade, marker = (styles({k[1] for k in curves}, c) for c in (SHADES, MARKERS))
    line = styles({k[2] for k in curves}, LINES)
    figure, grid = plt.subplots(2, len(scenes), figsize=(4.2 * len(scenes), 5.2), squeeze=False, sharex="col")
    figure.subplots_adjust(wspace=0.95, left=0.12 / len(scenes), right=1 - 0.36 / len(scenes), bottom=0.09, top=0.95, hspace=0.16)
    for column, scene in enumerate(scenes):
        started = math.inf
        for row, quality in enumerate(["psnr", "ssim"]):
            axes = grid[row][column]
            ends, all_points = [], []
            for (of, budget, steps), points in sorted(curves.items()):
                if of != scene:
                    continue
                points = sorted(points, key=lambda p: p["step"])
                axes.plot([p[time] for p in points], [p[quality] for p in points], color=shade[budget], ls=line[steps], lw=0.9,
                          marker=marker[budget], ms=2.6, mfc="white", mew=0.6, zorder=3)
                ends.append((points[-1][time], points[-1][quality], describe(budget, steps), shade[budget]))
                all_points += [(p[time], p[quality], shade[budget], marker[budget]) for p in points]
            front = pareto(all_points)
            axes.plot([p[0] for p in front], [p[1] for p in front], color="#cccccc", lw=4, drawstyle="steps-post", solid_joinstyle="round", zorder=1)
            for p in front:
                axes.plot(p[0], p[1], marker=p[3], ms=4, color=p[2], zorder=4)
            logarithmic(axes)
            # How a training ends is what counts: first steps may be outside the frame.
            best, worst = max(p[1] for p in all_points), min(e[1] for e in ends)
            worst = min(worst, best - (3 if quality == "psnr" else 0.1))
            margin = 0.1 * (best - worst)
            axes.set_ylim(worst - margin, best + margin)
            started = min([started, *(p[0] for p in all_points if p[1] >= worst - margin)])
            axes.set_xlim(left=0.8 * started)
            axes.set_ylabel("PSNR [dB]" if quality == "psnr" else "SSIM")
            if row == 0:
                axes.set_title(title(scene), loc="left")
                axes.tick_params(labelbottom=False)
            else:
                axes.set_xlabel("training time [CPU seconds, all threads]" if time == "cpu_seconds" else "training time [s]")
            label_at_right(axes, ends)
    return figure


def quality_over_cost(rows, scene):
    models = {k: r[0] for k, r in trainings(rows, "model").items() if k[0] == scene}
    if len({k[1] for k in models}) < 2:
        return None
    frames = {(r["command"], r["frame_size"]): r["frame_ms"] for r in rows if r["record"] == "frame"}
    commands = {m["command"] for m in models.values()}
    sizes = collections.Counter(size for command, size in frames if command in commands)
    size = max(sorted(sizes), key=sizes.get, default=None)
    if len(sizes) > 1:
        warn(f"{scene}: times of pictures of several sizes; drawn are those of {size}")
    models = {k: {**m, "frame_ms": frames.get((m["command"], size)), "frame_size": size} for k, m in models.items()}
    costs = [("triangles", 1, "triangles"), ("bytes", 1e-6, "model file [MB]")]
    timed = [m for m in models.values() if m["frame_ms"]]
    if timed:
        costs.append(("frame_ms", 1, f"time of a picture of {timed[0]['frame_size'].replace('x', ' x ')} [ms]"))
    series = sorted({k[2] for k in models})
    shade, marker, line = (styles(series, c) for c in (SHADES, MARKERS, LINES))
    figure, grid = plt.subplots(2, len(costs), figsize=(2.7 * len(costs), 4.4), squeeze=False, sharey="row")
    figure.subplots_adjust(wspace=0.12, left=0.07, right=0.86, bottom=0.1, top=0.94, hspace=0.14)
    for row, quality in enumerate(["psnr", "ssim"]):
        for column, (cost, unit, name) in enumerate(costs):
            axes = grid[row][column]
            ends = []
            for key in series:
                points = sorted(((m[cost] * unit, m[quality]) for k, m in models.items() if k[2] == key and m[cost]), key=lambda p: p[0])
                if not points:
                    continue
                axes.plot(*zip(*points), color=shade[key], ls=line[key], marker=marker[key], mfc="white", mew=0.8)
                ends.append((*points[-1], f"{short(key)} steps", shade[key]))
            logarithmic(axes)
            if column == 0:
                axes.set_ylabel("PSNR [dB]" if quality == "psnr" else "SSIM")
            if row == 0:
                axes.tick_params(labelbottom=False)
                if column == 0:
                    axes.set_title(title(scene), loc="left")
            else:
                axes.set_xlabel(name)
            if column == len(costs) - 1:
                label_at_right(axes, ends)
    return figure


def ablations(rows):
    """Every training that was made with several of ABLATIONS; a dot for each seed, their mean and range."""
    found = collections.defaultdict(lambda: collections.defaultdict(dict))
    for r in rows:
        if r["record"] == "model" and r["psnr"] is not None and r["ssim"] is not None:
            found[scene_name(r), r["budget"], r["steps"]][r["options"]][r["seed"]] = r
    found = {key: {n: o for n, o in options.items() if n in ABLATIONS} for key, options in sorted(found.items())}
    found = {key: options for key, options in found.items() if len(options) > 1}
    for key, options in list(found.items()):
        if not set.intersection(*(set(seeds) for seeds in options.values())):
            warn(f"no seed is common to the ablations of {key[0]}, {describe(*key[1:])}; left out")
            del found[key]
    if not found:
        return None
    figure, grid = plt.subplots(len(found), 2, figsize=(7.2, 0.7 + 1.7 * len(found)), squeeze=False)
    figure.subplots_adjust(left=0.19, right=0.98, wspace=0.12, hspace=0.5, bottom=0.3 / (0.5 + len(found)), top=1 - 0.2 / (0.5 + len(found)))
    for row, ((scene, budget, steps), options) in enumerate(found.items()):
        names = [n for n in ABLATIONS if n in options]
        # The same seeds of all, so that what differs is the option.
        seeds = sorted(set.intersection(*(set(options[n]) for n in names)))
        for column, quality in enumerate(["psnr", "ssim"]):
            axes = grid[row][column]
            for i, name in enumerate(names):
                values = [options[name][s][quality] for s in seeds]
                mean = statistics.fmean(values)
                axes.plot([min(values), max(values)], [i, i], color="#777777", lw=1)
                axes.plot(values, [i] * len(values), "o", mfc="white", mec="black", ms=4, mew=0.7)
                axes.plot(mean, i, "|", color="black", ms=9, mew=1.8)
                axes.annotate(f"{mean:.2f}" if quality == "psnr" else f"{mean:.3f}", (max(values), i), xytext=(6, 0), textcoords="offset points",
                              va="center", fontsize=7)
            axes.set_ylim(len(names) - 0.5, -0.5)
            axes.set_yticks(range(len(names)), names if column == 0 else [""] * len(names))
            axes.grid(axis="y", visible=False)
            axes.margins(x=0.16)
            axes.xaxis.set_major_locator(MaxNLocator(6))
            if column == 0:
                axes.set_title(title(f"{scene}, {describe(budget, steps)}, {len(seeds)} seed{'s' if len(seeds) > 1 else ''}"), loc="left")
            if row == len(found) - 1:
                axes.set_xlabel("PSNR [dB]" if quality == "psnr" else "SSIM")
    return figure


def quality_over_rate(rows):
    """PSNR over how far vertices can travel, of trainings that differ in nothing but the vertex rate and how rates fall."""
    found = collections.defaultdict(lambda: collections.defaultdict(list))
    for r in rows:
        s = r["settings"]
        if r["record"] == "model" and r["psnr"] is not None and all(k in s for k in ("lr_vertex", "lr_end", "steps", "seed")) and 0 < s["lr_end"] <= 1:
            same = {k: v for k, v in s.items() if k not in ("lr_vertex", "lr_end", "lr_vertex_end", "seed")}
            # The mean over t from 0 to 1 of end^t and of what the rest at the end leaves, times the steps.
            end, rest = s.get("lr_vertex_end", s["lr_end"]), s.get("rest_share", 0)
            times = [(i + 0.5) / 1000 for i in range(1000)]
            travel = s["lr_vertex"] * s["steps"] * sum(end ** t * min(1, (1 - t) / rest if rest else 1) for t in times) / 1000
            found[scene_name(r), r["budget"], r["steps"], json.dumps(same, sort_keys=True)][end].append((s["seed"], travel, r["psnr"]))
    for by_end in found.values():  # of several seeds the first
        for end, points in by_end.items():
            first = min(p[0] for p in points)
            by_end[end] = [p[1:] for p in points if p[0] == first]
    groups = {k: v for k, v in sorted(found.items()) if len({p[0] for points in v.values() for p in points}) > 2}
    if not groups:
        return None
    scenes = list(dict.fromkeys(k[0] for k in groups))
    line, marker, shade = (styles({e for v in groups.values() for e in v}, c) for c in (LINES, MARKERS, SHADES))
    fill = styles({k[2] for k in groups}, ["white", "#bbbbbb", "black"])
    figure, grid = plt.subplots(1, len(scenes), figsize=(4.6 * len(scenes), 2.9), squeeze=False)
    figure.subplots_adjust(wspace=1.15, left=0.11 / len(scenes), right=1 - 0.42 / len(scenes), bottom=0.16, top=0.92)
    for axes, scene in zip(grid[0], scenes):
        ends = []
        for (of, budget, steps, _), by_end in groups.items():
            if of != scene:
                continue
            for end, points in sorted(by_end.items()):
                points = sorted(points)
                axes.plot([p[0] for p in points], [p[1] for p in points], color=shade[end], ls=line[end], lw=0.9, marker=marker[end], ms=3.2, mew=0.7,
                          mfc=fill[steps])
                ends.append((points[-1][0], points[-1][1], f"{describe(budget, steps)}, to {100 * end:g} %", shade[end]))
        logarithmic(axes)
        axes.set_xlabel("way of a vertex: sum of its rates [normalised units]")
        axes.set_ylabel("PSNR [dB]")
        axes.set_title(title(scene), loc="left")
        label_at_right(axes, ends)
    return figure


def quality_over_knee(rows):
    """Quality over bytes, of trainings that differ in nothing but --knee, or with --knee 0 in the samples of a pixel: the uniform way."""
    found = collections.defaultdict(lambda: collections.defaultdict(dict))
    for r in rows:
        s = r["settings"]
        if r["record"] != "model" or None in (r["psnr"], r["ssim"], r["bytes"]) or not {"knee", "samples_per_pixel"} <= s.keys():
            continue
        same = json.dumps({k: v for k, v in s.items() if k not in ("knee", "samples_per_pixel")}, sort_keys=True)
        of = found[scene_name(r), r["budget"], r["steps"], same]
        if s["samples_per_pixel"] == 1:
            of["knee"][s["knee"]] = r
        if s["knee"] == 0:
            of["uniform"][s["samples_per_pixel"]] = r
    found = {k: v for k, v in sorted(found.items()) if len(v["knee"]) > 2}
    if not found:
        return None
    looks = {"knee": ("black", "-", "o", "{:g} dB"), "uniform": ("#777777", "--", "s", "{:g}")}
    figure, grid = plt.subplots(2, len(found), figsize=(4.2 * len(found), 4.6), squeeze=False)
    figure.subplots_adjust(left=0.09, right=0.97, wspace=0.24, bottom=0.1, top=0.94, hspace=0.12)
    for column, ((scene, budget, steps, _), series) in enumerate(found.items()):
        for axes, quality in zip(grid[:, column], ["psnr", "ssim"]):
            for name, by_value in series.items():
                colour, line, marker, text = looks[name]
                points = sorted((r["bytes"] * 1e-6, r[quality], value) for value, r in by_value.items())
                what = "--knee" if name == "knee" else "uniform: samples for each pixel"
                axes.plot([p[0] for p in points], [p[1] for p in points], color=colour, ls=line, marker=marker, mfc="white", mew=0.8, label=what)
                for x, y, value in points:
                    axes.annotate(text.format(value), (x, y), xytext=(0, 6 if name == "knee" else -11), textcoords="offset points", ha="center", fontsize=6, color=colour)
            logarithmic(axes)
            axes.margins(y=0.12)
            if column == 0:
                axes.set_ylabel("PSNR [dB]" if quality == "psnr" else "SSIM")
        grid[0][column].set_title(title(f"{scene}, {describe(budget, steps)}"), loc="left")
        grid[0][column].tick_params(labelbottom=False)
        grid[1][column].set_xlabel("model file [MB]")
    grid[0][0].legend(loc="lower right", fontsize=7, frameon=False)
    return figure


def quality_over_goals(rows):
    """Quality over bytes, of trainings towards a PSNR, and of those of the same scene without goal and knee: the uniform way."""
    found = collections.defaultdict(lambda: {"goal": [], "uniform": []})
    for r in rows:
        s = r["settings"]
        if r["record"] != "model" or None in (r["psnr"], r["ssim"], r["bytes"]) or not {"knee", "target_psnr", "samples_per_pixel"} <= s.keys():
            continue
        if s["target_psnr"] > 0:
            found[scene_name(r)]["goal"].append((r["bytes"] * 1e-6, r["psnr"], r["ssim"], f"{s['target_psnr']:g} dB"))
        elif s["knee"] == 0:
            found[scene_name(r)]["uniform"].append((r["bytes"] * 1e-6, r["psnr"], r["ssim"], s["samples_per_pixel"]))
    found = {k: v for k, v in sorted(found.items()) if len(v["goal"]) > 2}
    if not found:
        return None
    figure, grid = plt.subplots(2, len(found), figsize=(3.3 * len(found) + 0.5, 4.6), squeeze=False)
    figure.subplots_adjust(left=0.07, right=0.98, wspace=0.26, bottom=0.1, top=0.94, hspace=0.12)
    for column, (scene, series) in enumerate(found.items()):
        goals = sorted(series["goal"])
        for axes, quality in zip(grid[:, column], [1, 2]):
            axes.plot([p[0] for p in goals], [p[quality] for p in goals], color="black", marker="o", mfc="white", mew=0.8, label="--target-psnr")
            for samples, marker in zip(sorted({p[3] for p in series["uniform"]}, reverse=True), ["s", "v", "D", "^"]):
                points = sorted(p for p in series["uniform"] if p[3] == samples)
                axes.plot([p[0] for p in points], [p[quality] for p in points], color="#777777", ls="--", lw=0.8, marker=marker, ms=3.5, mfc="white", mew=0.8,
                          label=f"uniform, samples for each pixel: {samples:g}")
            for p in goals if quality == 1 else []:
                axes.annotate(p[3], (p[0], p[1]), xytext=(-3, 5), textcoords="offset points", ha="right", fontsize=6)
            logarithmic(axes)
            axes.margins(x=0.12, y=0.12)
            if column == 0:
                axes.set_ylabel("PSNR [dB]" if quality == 1 else "SSIM")
        grid[0][column].set_title(title(scene), loc="left")
        grid[0][column].tick_params(labelbottom=False)
        grid[1][column].set_xlabel("model file [MB]")
    grid[0][-1].legend(loc="lower right", fontsize=6, frameon=False)
    return figure


def step_by_kernel(rows):
    """Stacked over pixels, at the number of triangles that has most sizes, and over triangles, at the size that has most of them."""
    steps = collections.defaultdict(dict)
    for r in rows:
        if r["record"] == "step":
            steps[r["size"], r["triangles"], r["views"]][r["kernel"]] = r["kernel_ms"]
    panels = []
    for fixed, moving in ((1, 0), (0, 1)):
        groups = collections.defaultdict(list)
        for key in steps:
            groups[key[fixed], key[2]].append(key)
        best = max(groups.values(), key=len, default=[])
        if len(best) > 1:
            panels.append((moving, sorted(best)))
    if not panels:
        return None
    figure, grid = plt.subplots(1, len(panels), figsize=(4.1 * len(panels), 3.4), squeeze=False)
    figure.subplots_adjust(left=0.08, right=0.87, wspace=0.95, bottom=0.14, top=0.91)
    # One order and one look for both: the largest at the bottom, those that never come to 3 % together.
    share = collections.Counter()
    for _, keys in panels:
        for key in keys:
            total = sum(steps[key].values())
            for kernel, ms in steps[key].items():
                share[kernel] = max(share[kernel], ms / total)
    shown = [k for k, s in share.most_common() if s >= 0.03]
    others = [k for k in share if k not in shown]
    layers = shown + (["others"] if others else [])
    for axes, (moving, keys) in zip(grid[0], panels):
        x = [key[0] ** 2 * key[2] / 1e6 if moving == 0 else key[1] / 1e3 for key in keys]
        stack = [[steps[key].get(k, 0) for key in keys] for k in shown]
        if others:
            stack.append([sum(steps[key].get(k, 0) for k in others) for key in keys])
        below = [0.0] * len(x)
        ends = []
        for i, (layer, values) in enumerate(zip(layers, stack)):
            above = [b + v for b, v in zip(below, values)]
            grey = 0.97 - 0.45 * (i % 3) / 2
            axes.fill_between(x, below, above, facecolor=str(grey), edgecolor="black", lw=0.5, hatch=HATCHES[i % len(HATCHES)])
            ends.append((x[-1], (below[-1] + above[-1]) / 2, f"{layer} {values[-1]:.0f}" if values[-1] >= 10 else f"{layer} {values[-1]:.1f}", "black"))
            below = above
        axes.plot(x, below, "o-", color="black", ms=3, lw=1)
        axes.set_xlim(0, x[-1])
        axes.set_ylim(0, 1.02 * below[-1])
        axes.set_ylabel("time of a step [ms]")
        size, triangles, views = keys[0]
        if moving == 0:
            axes.set_xlabel("pixels of a step [millions]")
            axes.set_title(f"{short(triangles)} triangles, {views:g} views", loc="left")
        else:
            axes.set_xlabel("triangles [thousands]")
            axes.set_title(f"{views:g} views of {size:g} x {size:g}", loc="left")
        label_at_right(axes, ends)
    return figure


def save(figure, path, metadata):
    """The name always means a whole picture."""
    beside = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        figure.savefig(beside, metadata=metadata, bbox_inches="tight", pad_inches=0.04)
        os.replace(beside, path)
    finally:
        beside.unlink(missing_ok=True)


def main():
    class OneLine(argparse.ArgumentParser):
        def error(self, message):
            sys.exit(f"chart.py: {message}; see --help")

    parser = OneLine(description=__doc__.splitlines()[0])
    parser.add_argument("results", help="CSV file of soup-bench run")
    parser.add_argument("-o", "--output", required=True, help="folder for the pictures")
    parser.add_argument("--time", choices=["cpu", "wall"], default="wall",
                        help="axis of training time: seconds, or CPU seconds of all threads, which a busy machine changes less [wall]")
    arguments = parser.parse_args()
    try:
        rows = read(arguments.results)
        folder = pathlib.Path(arguments.output)
        folder.mkdir(parents=True, exist_ok=True)
        figures = {"quality_over_time": quality_over_time(rows, "cpu_seconds" if arguments.time == "cpu" else "seconds"),
                   "ablations": ablations(rows), "quality_over_rate": quality_over_rate(rows), "quality_over_knee": quality_over_knee(rows),
                   "quality_over_goals": quality_over_goals(rows), "step_by_kernel": step_by_kernel(rows)}
        revisions = sorted({r["revision"] for r in rows if r["record"] in ("evaluation", "model")})
        if len(revisions) > 1:
            warn(f"{arguments.results}: trainings of {len(revisions)} revisions of the program ({', '.join(revisions)}) in one picture")
        for scene in scenes_of([r for r in rows if r["record"] == "model"]):
            name = "quality_over_cost_" + re.sub(r"\W+", "_", scene)
            while name in figures:  # "a b" and "a_b"
                name += "_"
            figures[name] = quality_over_cost(rows, scene)
        drawn = 0
        for name, figure in figures.items():
            if figure is None:
                print(f"{name}: not measured, left out")
                continue
            for suffix, metadata in (("svg", {"Date": None}), ("png", {"Software": None})):
                save(figure, folder / f"{name}.{suffix}", metadata)
            drawn += 1
        if drawn == 0:
            raise ValueError(f"{arguments.results}: holds nothing to draw")
    except OSError as error:
        sys.exit(f"chart.py: {error.filename or arguments.results}: {error.strerror}; check the path")
    except ValueError as error:
        sys.exit(f"chart.py: {error}")


if __name__ == "__main__":
    main()
