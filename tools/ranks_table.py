#!/usr/bin/env python3
"""Estimates what several ranks send, hold in memory and compute alone in a training step, as Markdown tables.

docs/several_machines.md quotes them. Two ways of dividing a step of V views and P pixels over R ranks are compared.
Owned triangles: each rank owns a part of the triangles (engine/train/step/shared_soup.h). Divided views: each rank
renders a part of the views, and the gradients are summed. Bytes are those that one rank sends.
"""

from __future__ import annotations

from typing import NamedTuple, Sequence

# Bytes of a pixel.
FEATURES = 7 * 4  # also their gradients
COLOUR = 3 * 4
HIT = 16  # triangle, barycentrics, depth
CANDIDATE = 4 + HIT  # a hit before the nearest one is known, with the number of the pixel

MLP_BYTES = 595 * 4
MLP_GROUPS = 1024  # parts of the sum of the MLP's gradients; 64 on a CPU
SAMPLES = 774  # of a texture of levels 2..5
FINEST_SAMPLES = 561  # of its finest level
LAYERS = 3  # fragments of a pixel that pass the opacity test
VIEWS = 4
BLOCKS_ACROSS = 13  # blocks of 16 x 16 pixels in a view of 200 x 200
BLOCKS = VIEWS * BLOCKS_ACROSS ** 2

RANKS = (2, 4, 8, 16, 64)
PIXELS = 2_560_000  # 4 x 800 x 800
SMALL_PIXELS = 160_000  # 4 x 200 x 200
VIEW_SIZES = (("4 x 200 x 200", SMALL_PIXELS), ("4 x 800 x 800", PIXELS), ("4 x 1920 x 1080", 8_294_400))
TRIANGLES = (("15,000", 15_000), ("100,000", 100_000), ("1 M", 1_000_000), ("10 M", 10_000_000))

Step = dict[str, float]  # CPU ms by kernel

# soup-bench steps --backend cpu --size 200, AVX2, 25 November 2026.
STEP_2000: Step = {
    "bin": 0.86, "bin_scan": 0.05, "count_visible": 0.74, "edge_forces": 25.77, "loss_gradient": 8.08,
    "opacity_backward": 13.49, "place_pixels": 0.02, "project": 0.19, "sample_photographs": 4.37,
    "shade_backward": 29.59, "shade": 10.83, "ssim": 8.76, "update_mlp": 0.10, "update_textures": 36.66,
    "update_vertices": 0.13, "visibility": 10.84}
STEP_15000: Step = {
    "bin": 4.41, "bin_scan": 0.05, "count_visible": 0.80, "edge_forces": 30.92, "loss_gradient": 8.28,
    "opacity_backward": 46.79, "place_pixels": 0.07, "project": 1.43, "sample_photographs": 4.05,
    "shade_backward": 35.14, "shade": 17.82, "ssim": 9.67, "update_mlp": 0.10, "update_textures": 652.70,
    "update_vertices": 0.97, "visibility": 34.77}
STEPS = (("2,000 triangles, levels 2..4", STEP_2000), ("15,000 triangles, levels 2..5", STEP_15000))

# Kernels that every rank runs in full, and those of them that can be divided by pixels.
IN_FULL = (
    "project", "sample_photographs", "ssim", "loss_gradient", "count_visible", "place_pixels", "edge_forces",
    "update_vertices", "update_mlp")
BY_PIXELS = ("ssim", "loss_gradient", "edge_forces")


class Memory(NamedTuple):
    """Device memory of a rank in bytes: its share of the textures, and data that every rank has."""

    textures: float
    shared: float


def owned_bytes(pixels: int, ranks: int, groups: int = MLP_GROUPS) -> dict[str, float]:
    """Bytes sent with owned triangles, by exchange. Gradients include the sums of the MLP."""
    others = (ranks - 1) / ranks
    # Ranks with a fragment in a pixel, if triangles are distributed at random.
    with_candidates = ranks * (1 - (1 - 1 / ranks) ** LAYERS)
    return {
        "candidates": CANDIDATE * pixels * with_candidates / ranks * others,
        "winners": HIT * pixels * others,
        "features": FEATURES * pixels / ranks * others,
        "colours": COLOUR * pixels * others,
        "gradients": FEATURES * pixels / ranks * others + MLP_BYTES * groups * others,
    }


def divided_bytes(triangles: int, ranks: int) -> float:
    """Bytes sent with divided views: the gradients of textures and vertices in a ring sum, where each rank sends all
    but its own part twice."""
    return 2 * (ranks - 1) / ranks * triangles * (SAMPLES * 8 * 4 + 9 * 8)


def speedup(step: Step, ranks: int) -> float:
    """How many times faster a step is with kernels IN_FULL on every rank."""
    in_full = share_in_full(step)
    return 1 / (in_full + (1 - in_full) / ranks)


def share_in_full(step: Step) -> float:
    return sum(step[kernel] for kernel in IN_FULL) / sum(step.values())


def share_in_full_by_pixels(step: Step) -> float:
    """The share if BY_PIXELS are divided."""
    return sum(step[kernel] for kernel in IN_FULL if kernel not in BY_PIXELS) / sum(step.values())


def speedup_by_pixels(step: Step, ranks: int) -> float:
    """How many times faster a step is if BY_PIXELS are divided, a run of blocks for each rank. SSIM needs one more row
    of blocks, because its windows overlap the next run."""
    in_full = sum(ms for kernel, ms in step.items() if kernel in IN_FULL and kernel not in BY_PIXELS)
    margin = step["ssim"] * min(1 - 1 / ranks, (BLOCKS_ACROSS + 1) / BLOCKS if ranks > VIEWS else 0)
    divided = sum(step.values()) - in_full
    return sum(step.values()) / (in_full + divided / ranks + margin)


def bytes_by_pixels(pixels: int, visible: int, ranks: int) -> float:
    """Bytes sent in addition if BY_PIXELS are divided: the gradients of colours and the errors to all ranks, and
    fixed-point sums for the vertices of the triangles that a part shows. A triangle is seen in at most VIEWS views, so
    in as many parts."""
    return 16 * pixels / ranks * (ranks - 1) + 72 * visible * min(1, VIEWS / ranks) * (ranks - 1)


def memory(triangles: int, ranks: int, pixels: int) -> Memory:
    """Textures include opacities, gradients and moments."""
    textures = triangles * (SAMPLES * 8 * 12 + FINEST_SAMPLES * (8 * 4 + 12))
    shared = triangles * (36 + 36 + 12 + 72 + 4 + 16 + 8 + 64 * VIEWS) + pixels * (88 + 108)
    return Memory(textures / ranks, shared)


def megabytes(n: float) -> str:
    return f"{n / 1e6:,.0f}" if n >= 1e7 else f"{n / 1e6:.1f}"


def gigabytes(n: float) -> str:
    return f"{n / 1e9:,.1f}" if n < 1e11 else f"{n / 1e9:,.0f}"


def print_table(title: str, head: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
    print(f"{title}:\n")
    print("| " + " | ".join(head) + " |")
    print("| " + " | ".join("---" for _ in head) + " |")
    for row in rows:
        print("| " + " | ".join(str(cell) for cell in row) + " |")
    print()


def print_bytes(ranks_head: list[str]) -> None:
    rows = [[name, *(megabytes(sum(owned_bytes(pixels, r).values())) for r in RANKS)] for name, pixels in VIEW_SIZES]
    print_table("MB that a rank sends in a step, owned triangles",
                ["views and pixels, any number of triangles", *ranks_head], rows)
    rows = [[name, *(megabytes(divided_bytes(triangles, r)) for r in (2, 4)), f"at most {VIEWS} ranks", "", ""]
            for name, triangles in TRIANGLES]
    print_table("MB that a rank sends in a step, divided views", ["triangles, any number of pixels", *ranks_head], rows)
    exchanges = list(owned_bytes(1, 2))
    rows = [[str(r), *(megabytes(owned_bytes(PIXELS, r)[name]) for name in exchanges)] for r in RANKS]
    print_table("MB that a rank sends by exchange, owned triangles, 4 x 800 x 800", ["ranks", *exchanges], rows)


def print_times() -> None:
    rows = []
    for gigabits in (25, 100, 400):
        rate = gigabits * 1e9 / 8
        owned = [f"{1e3 * sum(owned_bytes(PIXELS, r).values()) / rate:.1f}" for r in RANKS]
        divided = [f"{1e3 * divided_bytes(triangles, 4) / rate:,.0f}" for triangles in (15_000, 1_000_000)]
        rows.append([str(gigabits), *owned, *divided])
    head = ["Gbit/s", *(f"owned, {r} ranks" for r in RANKS), "views, 4 ranks, 15,000 triangles", "1 M"]
    print_table("ms to send these bytes, 4 x 800 x 800", head, rows)


def print_memory(ranks_head: list[str]) -> None:
    rows = []
    for name, triangles in TRIANGLES:
        sizes = [memory(triangles, r, PIXELS) for r in (1, *RANKS)]
        rows.append([name, *(f"{gigabytes(size.textures)} + {gigabytes(size.shared)}" for size in sizes)])
    print_table("GB of device memory of a rank, levels 2..5, 4 x 800 x 800: its textures + data of every rank",
                ["triangles", "1 rank", *ranks_head], rows)


def print_speedups(ranks_head: list[str]) -> None:
    rows = []
    for name, step in STEPS:
        rows.append([name, f"{100 * share_in_full(step):.0f} %", *(f"{speedup(step, r):.1f}" for r in RANKS)])
        rows.append(["the same, loss divided by pixels", f"{100 * share_in_full_by_pixels(step):.0f} %",
                     *(f"{speedup_by_pixels(step, r):.1f}" for r in RANKS)])
    print_table("Share of a step that every rank computes, and how many times faster a step can be",
                ["step", "on every rank", *ranks_head], rows)
    rows = [[f"{visible:,}", *(megabytes(bytes_by_pixels(SMALL_PIXELS, visible, r)) for r in RANKS)]
            for visible in (2_000, 15_000)]
    print_table("MB that a rank sends in addition with the loss divided by pixels, 4 x 200 x 200",
                ["visible triangles", *ranks_head], rows)


def main() -> None:
    ranks_head = [f"{r} ranks" for r in RANKS]
    print_bytes(ranks_head)
    print_times()
    print_memory(ranks_head)
    print_speedups(ranks_head)


if __name__ == "__main__":
    main()
