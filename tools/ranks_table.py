#!/usr/bin/env python3
"""ranks_table.py: estimates of what several ranks send, hold and do alone in a training step. docs/several_machines.md quotes them.

Two ways of dividing a step of V views and P pixels over R ranks are held against each other: triangles owned by ranks, as
engine/train/step/shared_soup.h does it, and views divided among ranks, whose gradients are then summed. Bytes are those that one rank sends.
"""

FEATURES = 7 * 4        # of a pixel; and their gradients
COLOUR = 3 * 4
HIT = 16                # what a pixel shows: triangle, barycentrics, depth
CANDIDATE = 4 + HIT     # the same before it is known who wins, with the pixel's number
MLP, GROUPS = 595 * 4, 1024  # parameters, and the parts of their sum (64 on a CPU)
SAMPLES, LATTICE = 774, 561  # of a texture of levels 2..5: all of them, and those of the finest
LAYERS = 3              # fragments that pass in a pixel, at most one wins
VIEWS = 4


def bytes_when_triangles_are_owned(pixels, ranks, groups=GROUPS):
    """By exchange: candidates, winners, features, colours, gradients (with the MLP's sums)."""
    others = (ranks - 1) / ranks
    # Ranks with a fragment in a pixel, if triangles lie anywhere.
    with_candidates = ranks * (1 - (1 - 1 / ranks) ** LAYERS)
    return {
        "candidates": CANDIDATE * pixels * with_candidates / ranks * others,
        "winners": HIT * pixels * others,
        "features": FEATURES * pixels / ranks * others,
        "colours": COLOUR * pixels * others,
        "gradients": FEATURES * pixels / ranks * others + MLP * groups * others,
    }


def bytes_when_views_are_divided(triangles, ranks):
    """Gradients of all textures and vertices in a sum over a ring: each rank sends them twice, but for its own part."""
    return 2 * (ranks - 1) / ranks * triangles * (SAMPLES * 8 * 4 + 9 * 8)


JUDGING = ("ssim", "loss_gradient", "edge_forces")
BLOCKS, BLOCKS_ACROSS = 4 * 13 * 13, 13  # of 16 x 16 pixels, in 4 x 200 x 200


def faster_when_parts_are_judged_apart(step, alone, ranks):
    """How many times a step is faster where each rank judges a run of blocks. SSIM is computed for a row of blocks besides, whose windows reach in."""
    together = sum(v for k, v in step.items() if k in alone and k not in JUDGING)
    margin = step["ssim"] * min(1 - 1 / ranks, (BLOCKS_ACROSS + 1) / BLOCKS if ranks > VIEWS else 0)
    divided = sum(step.values()) - together
    return sum(step.values()) / (together + divided / ranks + margin)


def bytes_when_parts_are_judged_apart(pixels, visible, ranks):
    """Beyond what is sent anyway: gradients of the colours with the errors to all, since opacities are asked about everywhere, and the sums for the
    vertices of triangles that a part shows, in fixed point; a triangle is seen in VIEWS views at most, so in as many parts."""
    return 16 * pixels / ranks * (ranks - 1) + 72 * visible * min(1, VIEWS / ranks) * (ranks - 1)


def memory(triangles, ranks, pixels):
    """Bytes of device memory of a rank: of textures with opacities, gradients and moments; of all that every rank has."""
    textures = triangles * (SAMPLES * 8 * 12 + LATTICE * (8 * 4 + 12))
    every_rank = triangles * (36 + 36 + 12 + 72 + 4 + 16 + 8 + 64 * VIEWS) + pixels * (88 + 108)
    return textures / ranks, every_rank


def megabytes(n):
    return f"{n / 1e6:,.0f}" if n >= 1e7 else f"{n / 1e6:.1f}"


def gigabytes(n):
    return f"{n / 1e9:,.1f}" if n < 1e11 else f"{n / 1e9:,.0f}"


def table(head, rows):
    print("| " + " | ".join(head) + " |")
    print("| " + " | ".join("---" for _ in head) + " |")
    for row in rows:
        print("| " + " | ".join(str(cell) for cell in row) + " |")
    print()


def main():
    ranks_of = (2, 4, 8, 16, 64)
    print("MB that a rank sends in a step, triangles owned:\n")
    rows = []
    for name, pixels in (("4 x 200 x 200", 160_000), ("4 x 800 x 800", 2_560_000), ("4 x 1920 x 1080", 8_294_400)):
        rows.append([name] + [megabytes(sum(bytes_when_triangles_are_owned(pixels, r).values())) for r in ranks_of])
    table(["views and pixels, any number of triangles"] + [f"{r} ranks" for r in ranks_of], rows)

    print("The same with views divided:\n")
    rows = []
    for name, triangles in (("15,000", 15_000), ("100,000", 100_000), ("1 M", 1_000_000), ("10 M", 10_000_000)):
        rows.append([name] + [megabytes(bytes_when_views_are_divided(triangles, r)) for r in (2, 4)] + ["at most 4 views", "", ""])
    table(["triangles, any number of pixels"] + [f"{r} ranks" for r in ranks_of], rows)

    print("By exchange, 4 x 800 x 800:\n")
    names = list(bytes_when_triangles_are_owned(1, 2))
    rows = [[r] + [megabytes(bytes_when_triangles_are_owned(2_560_000, r)[n]) for n in names] for r in ranks_of]
    table(["ranks"] + names, rows)

    print("ms that these bytes take, 4 x 800 x 800:\n")
    rows = []
    for gigabits in (25, 100, 400):
        rate = gigabits * 1e9 / 8
        rows.append([gigabits] + [f"{1e3 * sum(bytes_when_triangles_are_owned(2_560_000, r).values()) / rate:.1f}" for r in ranks_of] +
                    [f"{1e3 * bytes_when_views_are_divided(t, 4) / rate:,.0f}" for t in (15_000, 1_000_000)])
    table(["Gbit/s"] + [f"owned, {r} ranks" for r in ranks_of] + ["views, 4 ranks, 15,000 triangles", "1 M"], rows)

    print("GB of device memory of a rank, levels 2..5, 4 x 800 x 800: textures divided + with every rank:\n")
    rows = []
    for name, triangles in (("15,000", 15_000), ("100,000", 100_000), ("1 M", 1_000_000), ("10 M", 10_000_000)):
        whole, same = memory(triangles, 1, 2_560_000)
        rows.append([name] + [f"{gigabytes(whole / r)} + {gigabytes(same)}" for r in (1,) + ranks_of])
    table(["triangles"] + ["1 rank"] + [f"{r} ranks" for r in ranks_of], rows)

    print("Share of a step that every rank does, and how many times faster a step can be for it:\n")
    # CPU ms by kernel: soup-bench steps --backend cpu --size 200, AVX2, 25 November 2026.
    measured = {
        "2,000 triangles, levels 2..4": STEP_2000,
        "15,000 triangles, levels 2..5": STEP_15000,
    }
    alone = ("project", "sample_photographs", "ssim", "loss_gradient", "count_visible", "place_pixels", "edge_forces", "update_vertices", "update_mlp")
    rows = []
    for name, step in measured.items():
        share = sum(step[k] for k in alone) / sum(step.values())
        rows.append([name, f"{100 * share:.0f} %"] + [f"{1 / (share + (1 - share) / r):.1f}" for r in ranks_of])
        rows.append(["the same, parts judged apart", f"{100 * sum(step[k] for k in alone if k not in JUDGING) / sum(step.values()):.0f} %"] +
                    [f"{faster_when_parts_are_judged_apart(step, alone, r):.1f}" for r in ranks_of])
    table(["step", "with every rank"] + [f"{r} ranks" for r in ranks_of], rows)

    print("MB more that a rank sends then, 4 x 200 x 200:\n")
    table(["triangles that are visible"] + [f"{r} ranks" for r in ranks_of],
          [[f"{t:,}"] + [megabytes(bytes_when_parts_are_judged_apart(160_000, t, r)) for r in ranks_of] for t in (2_000, 15_000)])


STEP_15000 = {"bin": 4.41, "bin_scan": 0.05, "count_visible": 0.80, "edge_forces": 30.92, "loss_gradient": 8.28, "opacity_backward": 46.79,
              "place_pixels": 0.07, "project": 1.43, "sample_photographs": 4.05, "shade_backward": 35.14, "shade": 17.82, "ssim": 9.67,
              "update_mlp": 0.10, "update_textures": 652.70, "update_vertices": 0.97, "visibility": 34.77}
STEP_2000 = {"bin": 0.86, "bin_scan": 0.05, "count_visible": 0.74, "edge_forces": 25.77, "loss_gradient": 8.08, "opacity_backward": 13.49,
             "place_pixels": 0.02, "project": 0.19, "sample_photographs": 4.37, "shade_backward": 29.59, "shade": 10.83, "ssim": 8.76,
             "update_mlp": 0.10, "update_textures": 36.66, "update_vertices": 0.13, "visibility": 10.84}

if __name__ == "__main__":
    main()
