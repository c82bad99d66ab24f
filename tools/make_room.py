#!/usr/bin/env python3
"""make_room.py OUT: photographs of a painted room from inside, in Blender's format, and its 12 triangles as OUT/room.obj.

Walls reach from before the camera to behind it, which is what `--preset published` loses (docs/decisions.md)."""
import json
import math
import pathlib
import struct
import sys
import zlib

SIDE, FOV = 80, 1.2  # pixels, radians
HALF = (2.0, 2.0, 1.2)
PAINT = [(0.8, 0.3, 0.2), (0.2, 0.6, 0.3), (0.25, 0.35, 0.8), (0.8, 0.7, 0.2), (0.5, 0.4, 0.35), (0.85, 0.85, 0.8)]  # -x +x -y +y -z +z
FOCAL = 0.5 * SIDE / math.tan(FOV / 2)


def unit(v):
    length = math.sqrt(sum(x * x for x in v))
    return [x / length for x in v]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def colour_along(eye, ray):
    """Colour of the wall that a ray from inside meets."""
    distance, wall = min(((math.copysign(HALF[k], ray[k]) - eye[k]) / ray[k], 2 * k + (ray[k] > 0)) for k in range(3) if ray[k])
    p = [eye[k] + ray[k] * distance for k in range(3)]
    u, v = p[1 if wall < 2 else 0], p[1 if wall > 3 else 2]
    check = (math.floor(2 * u) + math.floor(2 * v)) % 2
    return [min(1, c * (0.55 + 0.35 * check) + 0.06 + 0.06 * math.sin(7 * u + 3 * v)) for c in PAINT[wall]]


def photograph(eye, axes):
    """Rows of RGB bytes; 2 x 2 rays per pixel."""
    for j in range(SIDE):
        row = bytearray()
        for i in range(SIDE):
            total = [0, 0, 0]
            for s in (0.25, 0.75):
                for r in (0.25, 0.75):
                    a, b = (i + s - SIDE / 2) / FOCAL, -(j + r - SIDE / 2) / FOCAL
                    c = colour_along(eye, [a * axes[0][k] + b * axes[1][k] - axes[2][k] for k in range(3)])
                    total = [x + y for x, y in zip(total, c)]
            row += bytes(int(255 * x / 4 + 0.5) for x in total)
        yield row


def write_png(path, rows):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    pixels = zlib.compress(b"".join(b"\0" + bytes(row) for row in rows), 9)
    header = struct.pack(">IIBBBBB", SIDE, SIDE, 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", pixels) + chunk(b"IEND", b""))


def main():
    if len(sys.argv) != 2 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    out = pathlib.Path(sys.argv[1])
    for split, count, shift in (("train", 32, 0.0), ("test", 8, 0.37)):
        (out / split).mkdir(parents=True, exist_ok=True)
        frames = []
        for n in range(count):
            a = 10 * math.pi * (n + shift) / count
            eye = [1.2 * math.cos(a), 1.2 * math.sin(a), 0.3 * math.sin(3 * a + shift)]
            b = a + math.pi + 0.9 * math.sin(2.3 * n + shift)
            z = unit([-math.cos(b), -math.sin(b), -0.35 * math.sin(1.7 * n)])
            x = unit(cross([0, 0, 1], z))
            axes = [x, cross(z, x), z]
            write_png(out / split / f"{n:03}.png", photograph(eye, axes))
            pose = [[axis[k] for axis in axes] + [eye[k]] for k in range(3)] + [[0, 0, 0, 1]]
            frames.append({"file_path": f"./{split}/{n:03}", "transform_matrix": pose})
        (out / f"transforms_{split}.json").write_text(json.dumps({"camera_angle_x": FOV, "frames": frames}))
    corners = [[x * HALF[0], y * HALF[1], z * HALF[2]] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
    lines = ["v %g %g %g" % tuple(c) for c in corners]
    for a, b, c, d in ((1, 2, 4, 3), (5, 7, 8, 6), (1, 5, 6, 2), (3, 4, 8, 7), (1, 3, 7, 5), (2, 6, 8, 4)):
        lines += [f"f {a} {b} {c}", f"f {a} {c} {d}"]
    (out / "room.obj").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
