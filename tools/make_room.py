#!/usr/bin/env python3
"""Makes a painted room: photographs from inside, in the folder layout of NeRF-Synthetic, and a mesh of 12 triangles.

The walls reach from in front of each camera to behind it. `--preset published` loses them, because it drops triangles
instead of clipping them at the near plane (docs/decisions.md).
"""

from __future__ import annotations

import argparse
import json
import math
import struct
import zlib
from pathlib import Path
from typing import Iterable, Iterator

SIDE = 80  # pixels
FOV = 1.2  # radians
HALF = (2.0, 2.0, 1.2)  # half of the room's sides
# Colours of the walls -x, +x, -y, +y, -z, +z.
PAINT = [
    (0.8, 0.3, 0.2), (0.2, 0.6, 0.3), (0.25, 0.35, 0.8), (0.8, 0.7, 0.2), (0.5, 0.4, 0.35), (0.85, 0.85, 0.8)]
FOCAL = 0.5 * SIDE / math.tan(FOV / 2)
SPLITS = (("train", 32, 0.0), ("test", 8, 0.37))  # name, views, shift along the path of the camera
# Corners of the walls in the mesh, from 1.
WALLS = ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4))

Vector = list[float]


def unit(v: Vector) -> Vector:
    length = math.sqrt(sum(x * x for x in v))
    return [x / length for x in v]


def cross(a: Vector, b: Vector) -> Vector:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def colour_along(eye: Vector, ray: Vector) -> Vector:
    """Colour of the wall that a ray from inside the room hits."""
    hits = [((math.copysign(HALF[k], ray[k]) - eye[k]) / ray[k], 2 * k + (ray[k] > 0)) for k in range(3) if ray[k]]
    distance, wall = min(hits)
    p = [eye[k] + ray[k] * distance for k in range(3)]
    u, v = p[1 if wall < 2 else 0], p[1 if wall > 3 else 2]
    check = (math.floor(2 * u) + math.floor(2 * v)) % 2
    return [min(1, c * (0.55 + 0.35 * check) + 0.06 + 0.06 * math.sin(7 * u + 3 * v)) for c in PAINT[wall]]


def photograph(eye: Vector, axes: list[Vector]) -> Iterator[bytearray]:
    """Rows of RGB bytes, from 2 x 2 rays per pixel. axes: right, up and back of the camera."""
    for j in range(SIDE):
        row = bytearray()
        for i in range(SIDE):
            total = [0.0, 0.0, 0.0]
            for s in (0.25, 0.75):
                for r in (0.25, 0.75):
                    a, b = (i + s - SIDE / 2) / FOCAL, -(j + r - SIDE / 2) / FOCAL
                    colour = colour_along(eye, [a * axes[0][k] + b * axes[1][k] - axes[2][k] for k in range(3)])
                    total = [x + y for x, y in zip(total, colour)]
            row += bytes(int(255 * x / 4 + 0.5) for x in total)
        yield row


def png_chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def write_png(path: Path, rows: Iterable[bytearray]) -> None:
    pixels = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows), 9)
    header = struct.pack(">IIBBBBB", SIDE, SIDE, 8, 2, 0, 0, 0)
    chunks = png_chunk(b"IHDR", header) + png_chunk(b"IDAT", pixels) + png_chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunks)


def write_view(out: Path, split: str, n: int, count: int, shift: float) -> dict[str, object]:
    """Writes a photograph. Returns its entry in transforms_*.json."""
    a = 10 * math.pi * (n + shift) / count
    eye = [1.2 * math.cos(a), 1.2 * math.sin(a), 0.3 * math.sin(3 * a + shift)]
    b = a + math.pi + 0.9 * math.sin(2.3 * n + shift)
    back = unit([-math.cos(b), -math.sin(b), -0.35 * math.sin(1.7 * n)])
    right = unit(cross([0, 0, 1], back))
    axes = [right, cross(back, right), back]
    write_png(out / split / f"{n:03}.png", photograph(eye, axes))
    pose = [[axis[k] for axis in axes] + [eye[k]] for k in range(3)] + [[0, 0, 0, 1]]
    return {"file_path": f"./{split}/{n:03}", "transform_matrix": pose}


def write_mesh(path: Path) -> None:
    corners = [[x * HALF[0], y * HALF[1], z * HALF[2]] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    lines = [f"v {x:g} {y:g} {z:g}" for x, y, z in corners]
    for a, b, c, d in WALLS:
        lines += [f"f {a} {b} {c}", f"f {a} {c} {d}"]
    path.write_text("\n".join(lines) + "\n")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("output", type=Path, metavar="OUT", help="folder for the dataset and room.obj")
    out = parser.parse_args().output
    for split, count, shift in SPLITS:
        (out / split).mkdir(parents=True, exist_ok=True)
        frames = [write_view(out, split, n, count, shift) for n in range(count)]
        (out / f"transforms_{split}.json").write_text(json.dumps({"camera_angle_x": FOV, "frames": frames}))
    write_mesh(out / "room.obj")


if __name__ == "__main__":
    main()
