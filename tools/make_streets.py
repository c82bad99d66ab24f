#!/usr/bin/env python3
"""Makes a town of streets and houses: photographs from the air, in the folder layout of NeRF-Synthetic, and a mesh of as many triangles as are asked
for, to start from with soup-train --init OUT/streets.ply. For what large scenes need (docs/several_machines.md). Needs numpy."""
import argparse
import json
import math
import pathlib
import struct
import zlib

import numpy as np

STREET = 0.3          # share of a plot's side that is street
LOW, HIGH = 0.03, 0.2  # of houses; the town is 2 x 2 large
FOV = 0.8             # radians


def arguments():
    parser = argparse.ArgumentParser(prog="make_streets.py", description=__doc__)
    parser.add_argument("output", type=pathlib.Path, metavar="OUT")
    parser.add_argument("--triangles", type=int, default=1_000_000, help="of the mesh, at most [1000000]")
    parser.add_argument("--plots", type=int, default=30, help="houses along each side [30]")
    parser.add_argument("--train", type=int, default=60, help="training views [60]")
    parser.add_argument("--test", type=int, default=4, help="test views [4]")
    parser.add_argument("--size", type=int, default=400, help="side of the photographs in pixels [400]")
    parser.add_argument("--seed", type=int, default=1)
    return parser.parse_args()


class Town:
    def __init__(self, plots, seed):
        rng = np.random.default_rng(seed)
        self.plots, self.pitch = plots, 2.0 / plots
        self.heights = rng.uniform(LOW, HIGH, (plots, plots))
        self.paint = rng.uniform(0.35, 0.9, (plots, plots, 3))

    def low_corner(self, i, j):
        return -1 + (i + STREET / 2) * self.pitch, -1 + (j + STREET / 2) * self.pitch

    def house_side(self):
        return (1 - STREET) * self.pitch

    def photograph(self, eye, axes, size):
        """RGBA bytes, [size, size, 4]; the sky is transparent."""
        focal = 0.5 * size / math.tan(FOV / 2)
        x, y = np.meshgrid((np.arange(size) + 0.5 - size / 2) / focal, -(np.arange(size) + 0.5 - size / 2) / focal)
        ray = (x[..., None] * axes[0] + y[..., None] * axes[1] - axes[2]).reshape(-1, 3)
        colours = np.zeros((size * size, 4), np.uint8)
        ground = np.where(ray[:, 2] < 0, -eye[2] / np.minimum(ray[:, 2], -1e-9), np.inf)
        t, house, axis = self.first_house(eye, ray, ground)
        hit = t < ground
        p = eye + np.where(hit, t, ground)[:, None] * ray
        on_ground = ~hit & (np.abs(p[:, 0]) < 1) & (np.abs(p[:, 1]) < 1)
        rgb = np.zeros((size * size, 3))
        rgb[on_ground] = self.street_colours(p[on_ground])
        rgb[hit] = self.house_colours(p[hit], house[hit], axis[hit])
        seen = hit | on_ground
        colours[seen, :3] = np.clip(255 * rgb[seen] + 0.5, 0, 255).astype(np.uint8)
        colours[seen, 3] = 255
        return colours.reshape(size, size, 4)

    def first_house(self, eye, ray, ground):
        """Where rays meet the first house: how far, which, and across which axis they enter. They go from plot to plot."""
        n, count = self.plots, len(ray)
        best = np.full(count, np.inf)
        house, axis = np.zeros(count, int), np.zeros(count, int)
        safe = np.where(np.abs(ray) < 1e-12, 1e-12, ray)
        with np.errstate(invalid="ignore"):
            sides = (np.sign(safe[:, :2]) * -1 - eye[:2]) / safe[:, :2]
        start = np.maximum(np.maximum(sides.max(1), (HIGH - eye[2]) / safe[:, 2]), 0) + 1e-9
        active = np.nonzero((safe[:, 2] < 0) & (start < ground))[0]
        t = start.copy()
        while len(active):
            r = safe[active]
            p = eye + t[active, None] * r
            cell = np.floor((p[:, :2] + 1) / self.pitch).astype(int)
            inside = ((cell >= 0) & (cell < n)).all(1) & (t[active] < ground[active])
            active, r, p, cell = active[inside], r[inside], p[inside], cell[inside]
            if not len(active):
                break
            low = np.stack([-1 + (cell[:, 0] + STREET / 2) * self.pitch, -1 + (cell[:, 1] + STREET / 2) * self.pitch, np.zeros(len(active))], 1)
            high = low + self.house_side()
            high[:, 2] = self.heights[cell[:, 0], cell[:, 1]]
            a, b = (low - eye) / r, (high - eye) / r
            enter, leave = np.minimum(a, b), np.maximum(a, b)
            first, last = enter.max(1), leave.min(1)
            met = (first < last) & (first > 0)
            best[active[met]] = first[met]
            house[active[met]] = (cell[:, 0] * n + cell[:, 1])[met]
            axis[active[met]] = enter.argmax(1)[met]
            border = -1 + (cell + (r[:, :2] > 0)) * self.pitch
            t[active] = ((border - eye[:2]) / r[:, :2]).min(1) + 1e-9
            active = active[~met]
        return best, house, axis

    def street_colours(self, p):
        within = np.mod((p[:, :2] + 1) / self.pitch, 1.0)
        edge = np.minimum(within, 1 - within).min(1)
        marked = (edge < 0.02) & (np.mod(within * 12, 2).max(1) < 1.2)
        kerb = (edge > STREET / 2 - 0.04)
        grey = 0.3 + 0.05 * np.sin(90 * p[:, 0]) * np.sin(70 * p[:, 1])
        return np.where(marked, 0.85, np.where(kerb, 0.6, grey))[:, None] * np.array([1, 1, 0.97])

    def house_colours(self, p, house, axis):
        paint = self.paint[house // self.plots, house % self.plots]
        along = np.where(axis == 0, p[:, 1], p[:, 0])
        window = (np.mod(along * 150, 3) < 1.3) & (np.mod(p[:, 2] * 110, 2) < 1.1)
        wall = np.where(window[:, None], np.array([0.15, 0.2, 0.3]), paint * np.where(axis == 0, 0.8, 1.0)[:, None])
        tiles = paint * np.array([0.9, 0.55, 0.45]) * (0.8 + 0.2 * (np.mod(p[:, 0] * 200, 2) < 1))[:, None]
        return np.where((axis == 2)[:, None], tiles, wall)

    def faces(self):
        """Rectangles as corner, edge, edge."""
        yield (-1, -1, 0), (2, 0, 0), (0, 2, 0)
        s = self.house_side()
        for i in range(self.plots):
            for j in range(self.plots):
                (x, y), h = self.low_corner(i, j), self.heights[i, j]
                yield (x, y, h), (s, 0, 0), (0, s, 0)
                yield (x, y, 0), (s, 0, 0), (0, 0, h)
                yield (x, y + s, 0), (s, 0, 0), (0, 0, h)
                yield (x, y, 0), (0, s, 0), (0, 0, h)
                yield (x + s, y, 0), (0, s, 0), (0, 0, h)

    def mesh(self, most):
        """Positions and triangles of all faces, cut into squares that are about as large everywhere."""
        faces = [tuple(np.array(v, float) for v in face) for face in self.faces()]
        lengths = [(np.linalg.norm(u), np.linalg.norm(v)) for _, u, v in faces]
        side = math.sqrt(2 * sum(a * b for a, b in lengths) / most)
        cuts = lambda: [(math.ceil(a / side), math.ceil(b / side)) for a, b in lengths]
        while 2 * sum(a * b for a, b in cuts()) > most:
            side *= 1.002
        positions, triangles, first = [], [], 0
        for (corner, u, v), (a, b) in zip(faces, cuts()):
            s, r = np.meshgrid(np.linspace(0, 1, a + 1), np.linspace(0, 1, b + 1), indexing="ij")
            positions.append(corner + s.reshape(-1, 1) * u + r.reshape(-1, 1) * v)
            at = first + (np.arange(a)[:, None] * (b + 1) + np.arange(b)[None]).reshape(-1)
            triangles += [np.stack([at, at + b + 1, at + 1], 1), np.stack([at + 1, at + b + 1, at + b + 2], 1)]
            first += (a + 1) * (b + 1)
        return np.concatenate(positions).astype("<f4"), np.concatenate(triangles).astype("<i4")


def write_ply(path, positions, triangles):
    header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(positions)}\nproperty float x\nproperty float y\nproperty float z\n"
              f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n")
    rows = np.zeros(len(triangles), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    rows["count"], rows["corners"] = 3, triangles
    path.write_bytes(header.encode() + positions.tobytes() + rows.tobytes())


def write_png(path, rgba):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    height, width = rgba.shape[:2]
    rows = np.concatenate([np.zeros((height, 1), np.uint8), rgba.reshape(height, -1)], 1)
    header = struct.pack(">IIBBBBB", width, height, 8, 6, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows.tobytes(), 3)) + chunk(b"IEND", b""))


def main():
    options = arguments()
    town = Town(options.plots, options.seed)
    for split, count, shift in (("train", options.train, 0.0), ("test", options.test, 0.5)):
        (options.output / split).mkdir(parents=True, exist_ok=True)
        frames = []
        for n in range(count):
            turn, height = 2.4 * (n + shift), math.radians(25 + 50 * ((0.618 * n + shift) % 1))
            back = np.array([math.cos(turn) * math.cos(height), math.sin(turn) * math.cos(height), math.sin(height)])
            right = np.cross([0, 0, 1], back)
            right /= np.linalg.norm(right)
            axes, eye = [right, np.cross(back, right), back], 3 * back
            write_png(options.output / split / f"{n:03}.png", town.photograph(eye, axes, options.size))
            pose = [[float(axis[k]) for axis in axes] + [float(eye[k])] for k in range(3)] + [[0, 0, 0, 1]]
            frames.append({"file_path": f"./{split}/{n:03}", "transform_matrix": pose})
        (options.output / f"transforms_{split}.json").write_text(json.dumps({"camera_angle_x": FOV, "frames": frames}))
    positions, triangles = town.mesh(options.triangles)
    write_ply(options.output / "streets.ply", positions, triangles)
    print(f"{options.output}: {options.train} + {options.test} views, {len(triangles)} triangles")


if __name__ == "__main__":
    main()
