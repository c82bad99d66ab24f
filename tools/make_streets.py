#!/usr/bin/env python3
"""Makes a town of streets and houses: photographs from the air, in the folder layout of NeRF-Synthetic, and a mesh.

The mesh has about as many triangles as asked for; soup-train --init OUT/streets.ply starts from it. For measurements of
large scenes (docs/several_machines.md). Needs numpy.
"""

from __future__ import annotations

import argparse
import json
import math
import struct
import zlib
from pathlib import Path
from typing import Iterator, NamedTuple

import numpy as np
from numpy.typing import NDArray

STREET = 0.3  # share of the side of a plot
LOW, HIGH = 0.03, 0.2  # heights of houses; the town is 2 x 2 large
FOV = 0.8  # radians
EPSILON = 1e-9

Array = NDArray[np.float64]
Indices = NDArray[np.int64]
Mask = NDArray[np.bool_]
Corner = tuple[float, float, float]


class Face(NamedTuple):
    """A rectangle: a corner and the two edges that begin there."""

    corner: Corner
    u: Corner
    v: Corner


class Hits(NamedTuple):
    """The hits of rays and houses: distance (infinite if none), house, and the axis of the wall."""

    distance: Array
    house: Indices
    axis: Indices


class Photograph(NamedTuple):
    """A picture and its depths along the viewing direction, 0 where there is sky."""

    rgba: NDArray[np.uint8]  # [size, size, 4]
    depth: NDArray[np.float32]  # [size, size]


class Boxes(NamedTuple):
    """Distances at which rays enter and leave boxes, by axis."""

    enter: Array
    leave: Array


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="make_streets.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("output", type=Path, metavar="OUT", help="folder for the dataset and streets.ply")
    parser.add_argument("--triangles", type=int, default=1_000_000, help="largest number of triangles [1000000]")
    parser.add_argument("--plots", type=int, default=30, help="houses along each side of the town [30]")
    parser.add_argument("--train", type=int, default=60, help="training views [60]")
    parser.add_argument("--test", type=int, default=4, help="test views [4]")
    parser.add_argument("--size", type=int, default=400, help="side of the photographs, pixels [400]")
    parser.add_argument("--seed", type=int, default=1, help="seed of heights and colours [1]")
    parser.add_argument("--depths", action="store_true", help="also write exact depth maps (for --depth-maps metric)")
    return parser.parse_args()


class Town:
    """A square of plots with a house on each."""

    def __init__(self, plots: int, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.plots, self.pitch = plots, 2.0 / plots
        self.heights = rng.uniform(LOW, HIGH, (plots, plots))
        self.paint = rng.uniform(0.35, 0.9, (plots, plots, 3))

    @property
    def house_side(self) -> float:
        return (1 - STREET) * self.pitch

    # Photographs.

    def photograph(self, eye: Array, axes: list[Array], size: int) -> Photograph:
        """The sky is transparent. axes: right, up and back of the camera."""
        focal = 0.5 * size / math.tan(FOV / 2)
        x, y = np.meshgrid((np.arange(size) + 0.5 - size / 2) / focal, -(np.arange(size) + 0.5 - size / 2) / focal)
        ray = (x[..., None] * axes[0] + y[..., None] * axes[1] - axes[2]).reshape(-1, 3)
        ground = np.where(ray[:, 2] < 0, -eye[2] / np.minimum(ray[:, 2], -EPSILON), np.inf)
        hits = self.first_houses(eye, ray, ground)
        is_house = hits.distance < ground
        depth = np.where(is_house, hits.distance, ground)  # along the viewing direction, as the rays have depth 1
        p = eye + depth[:, None] * ray
        is_ground = ~is_house & (np.abs(p[:, 0]) < 1) & (np.abs(p[:, 1]) < 1)
        rgb = np.zeros((size * size, 3))
        rgb[is_ground] = self.street_colours(p[is_ground])
        rgb[is_house] = self.house_colours(p[is_house], hits.house[is_house], hits.axis[is_house])
        is_seen = is_house | is_ground
        rgba = np.zeros((size * size, 4), np.uint8)
        rgba[is_seen, :3] = np.clip(255 * rgb[is_seen] + 0.5, 0, 255).astype(np.uint8)
        rgba[is_seen, 3] = 255
        depth = np.where(is_seen, depth, 0).astype("<f4")
        return Photograph(rgba.reshape(size, size, 4), depth.reshape(size, size))

    def first_houses(self, eye: Array, ray: Array, ground: Array) -> Hits:
        """The first house that each ray hits. Rays advance from plot to plot until they hit a house or the ground."""
        count = len(ray)
        hits = Hits(np.full(count, np.inf), np.zeros(count, int), np.zeros(count, int))
        safe = np.where(np.abs(ray) < 1e-12, 1e-12, ray)
        t = self.start(eye, safe)
        active = np.nonzero((safe[:, 2] < 0) & (t < ground))[0]
        while len(active):
            p = eye + t[active, None] * safe[active]
            plot = np.floor((p[:, :2] + 1) / self.pitch).astype(int)
            is_inside = ((plot >= 0) & (plot < self.plots)).all(1) & (t[active] < ground[active])
            active, plot = active[is_inside], plot[is_inside]
            if not len(active):
                break
            r = safe[active]
            boxes = self.houses(eye, r, plot)
            first, last = boxes.enter.max(1), boxes.leave.min(1)
            is_hit = (first < last) & (first > 0)
            hit = active[is_hit]
            hits.distance[hit] = first[is_hit]
            hits.house[hit] = (plot[:, 0] * self.plots + plot[:, 1])[is_hit]
            hits.axis[hit] = boxes.enter.argmax(1)[is_hit]
            border = -1 + (plot + (r[:, :2] > 0)) * self.pitch
            t[active] = ((border - eye[:2]) / r[:, :2]).min(1) + EPSILON
            active = active[~is_hit]
        return hits

    def start(self, eye: Array, ray: Array) -> Array:
        """Distances at which rays come above the town and below the height of the tallest house."""
        with np.errstate(invalid="ignore"):
            sides = (np.sign(ray[:, :2]) * -1 - eye[:2]) / ray[:, :2]
        return np.maximum(np.maximum(sides.max(1), (HIGH - eye[2]) / ray[:, 2]), 0) + EPSILON

    def houses(self, eye: Array, ray: Array, plot: Indices) -> Boxes:
        """Distances at which each ray enters and leaves the house of a plot."""
        corners = [-1 + (plot[:, k] + STREET / 2) * self.pitch for k in range(2)]
        low = np.stack([*corners, np.zeros(len(plot))], 1)
        high = low + self.house_side
        high[:, 2] = self.heights[plot[:, 0], plot[:, 1]]
        a, b = (low - eye) / ray, (high - eye) / ray
        return Boxes(np.minimum(a, b), np.maximum(a, b))

    def street_colours(self, p: Array) -> Array:
        within = np.mod((p[:, :2] + 1) / self.pitch, 1.0)
        edge = np.minimum(within, 1 - within).min(1)
        is_marking = (edge < 0.02) & (np.mod(within * 12, 2).max(1) < 1.2)
        is_kerb = edge > STREET / 2 - 0.04
        grey = 0.3 + 0.05 * np.sin(90 * p[:, 0]) * np.sin(70 * p[:, 1])
        return np.where(is_marking, 0.85, np.where(is_kerb, 0.6, grey))[:, None] * np.array([1, 1, 0.97])

    def house_colours(self, p: Array, house: Indices, axis: Indices) -> Array:
        paint = self.paint[house // self.plots, house % self.plots]
        along = np.where(axis == 0, p[:, 1], p[:, 0])
        is_window = (np.mod(along * 150, 3) < 1.3) & (np.mod(p[:, 2] * 110, 2) < 1.1)
        lit = paint * np.where(axis == 0, 0.8, 1.0)[:, None]
        wall = np.where(is_window[:, None], np.array([0.15, 0.2, 0.3]), lit)
        tiles = paint * np.array([0.9, 0.55, 0.45]) * (0.8 + 0.2 * (np.mod(p[:, 0] * 200, 2) < 1))[:, None]
        return np.where((axis == 2)[:, None], tiles, wall)

    # The mesh.

    def faces(self) -> Iterator[Face]:
        yield Face((-1, -1, 0), (2, 0, 0), (0, 2, 0))
        s = self.house_side
        for i in range(self.plots):
            for j in range(self.plots):
                x, y = -1 + (i + STREET / 2) * self.pitch, -1 + (j + STREET / 2) * self.pitch
                h = self.heights[i, j]
                yield Face((x, y, h), (s, 0, 0), (0, s, 0))
                yield Face((x, y, 0), (s, 0, 0), (0, 0, h))
                yield Face((x, y + s, 0), (s, 0, 0), (0, 0, h))
                yield Face((x, y, 0), (0, s, 0), (0, 0, h))
                yield Face((x + s, y, 0), (0, s, 0), (0, 0, h))

    def mesh(self, max_triangles: int) -> tuple[NDArray[np.float32], NDArray[np.int32]]:
        """Positions and triangles of all faces, cut into squares of about the same size."""
        faces = [tuple(np.array(v, float) for v in face) for face in self.faces()]
        cuts = cuts_of([(float(np.linalg.norm(u)), float(np.linalg.norm(v))) for _, u, v in faces], max_triangles)
        positions, triangles, first = [], [], 0
        for (corner, u, v), (a, b) in zip(faces, cuts):
            s, r = np.meshgrid(np.linspace(0, 1, a + 1), np.linspace(0, 1, b + 1), indexing="ij")
            positions.append(corner + s.reshape(-1, 1) * u + r.reshape(-1, 1) * v)
            at = first + (np.arange(a)[:, None] * (b + 1) + np.arange(b)[None]).reshape(-1)
            triangles += [np.stack([at, at + b + 1, at + 1], 1), np.stack([at + 1, at + b + 1, at + b + 2], 1)]
            first += (a + 1) * (b + 1)
        return np.concatenate(positions).astype("<f4"), np.concatenate(triangles).astype("<i4")


def cuts_of(lengths: list[tuple[float, float]], max_triangles: int) -> list[tuple[int, int]]:
    """Squares along both edges of each face: as small as possible with at most `max_triangles`."""
    side = math.sqrt(2 * sum(a * b for a, b in lengths) / max_triangles)
    while True:
        cuts = [(math.ceil(a / side), math.ceil(b / side)) for a, b in lengths]
        if 2 * sum(a * b for a, b in cuts) <= max_triangles:
            return cuts
        side *= 1.002


def write_ply(path: Path, positions: NDArray[np.float32], triangles: NDArray[np.int32]) -> None:
    header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(positions)}\n"
              "property float x\nproperty float y\nproperty float z\n"
              f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n")
    rows = np.zeros(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, triangles
    path.write_bytes(header.encode() + positions.tobytes() + rows.tobytes())


def png_chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def write_png(path: Path, rgba: NDArray[np.uint8]) -> None:
    height, width = rgba.shape[:2]
    rows = np.concatenate([np.zeros((height, 1), np.uint8), rgba.reshape(height, -1)], 1)
    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    pixels = zlib.compress(rows.tobytes(), 3)
    chunks = png_chunk(b"IHDR", header) + png_chunk(b"IDAT", pixels) + png_chunk(b"IEND", b"")
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunks)


def write_view(town: Town, options: argparse.Namespace, split: str, n: int, shift: float) -> dict[str, object]:
    """Writes a photograph. Returns its entry in transforms_*.json."""
    turn, elevation = 2.4 * (n + shift), math.radians(25 + 50 * ((0.618 * n + shift) % 1))
    flat = math.cos(elevation)
    back = np.array([math.cos(turn) * flat, math.sin(turn) * flat, math.sin(elevation)])
    right = np.cross([0, 0, 1], back)
    right /= np.linalg.norm(right)
    axes, eye = [right, np.cross(back, right), back], 3 * back
    photograph = town.photograph(eye, axes, options.size)
    write_png(options.output / split / f"{n:03}.png", photograph.rgba)
    pose = [[float(axis[k]) for axis in axes] + [float(eye[k])] for k in range(3)] + [[0, 0, 0, 1]]
    frame: dict[str, object] = {"file_path": f"./{split}/{n:03}", "transform_matrix": pose}
    if options.depths:
        frame["depth_file_path"] = f"./depth/{split}/{n:03}.npy"
        np.save(options.output / "depth" / split / f"{n:03}.npy", photograph.depth)
    return frame


def main() -> None:
    options = arguments()
    town = Town(options.plots, options.seed)
    for split, count, shift in (("train", options.train, 0.0), ("test", options.test, 0.5)):
        for folder in [split] + ([f"depth/{split}"] if options.depths else []):
            (options.output / folder).mkdir(parents=True, exist_ok=True)
        frames = [write_view(town, options, split, n, shift) for n in range(count)]
        transforms = json.dumps({"camera_angle_x": FOV, "frames": frames})
        (options.output / f"transforms_{split}.json").write_text(transforms)
    positions, triangles = town.mesh(options.triangles)
    write_ply(options.output / "streets.ply", positions, triangles)
    print(f"{options.output}: {options.train} + {options.test} views, {len(triangles)} triangles")


if __name__ == "__main__":
    main()
