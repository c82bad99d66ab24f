#!/usr/bin/env python3
"""Draws a film strip of a trained model: pictures from training cameras and from between them, in one PNG.

    tools/film_strip.py out/garden -o strip.png --frames 24

The frames lie on the straight way from each training camera to the next one, where a model that only fits its
photographs tears. Needs soup-view, numpy and matplotlib.
"""

from __future__ import annotations

import argparse
import math
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import NoReturn

try:
    import matplotlib.image
    import numpy as np
    from numpy.typing import NDArray
except ImportError as missing:
    sys.exit(f"film_strip.py: {missing}; install python3-matplotlib")

Picture = NDArray[np.float32]

GAP = 4  # pixels between frames
MOST_FRAMES = 500


class OneLineParser(argparse.ArgumentParser):
    """Prints errors in one line."""

    def error(self, message: str) -> NoReturn:
        sys.exit(f"film_strip.py: {message}; see --help")


def count_from_1(text: str) -> int:
    if not text.isdecimal() or not 1 <= int(text) <= MOST_FRAMES:
        raise argparse.ArgumentTypeError(f"{text} is not a number from 1 to {MOST_FRAMES}")
    return int(text)


def arguments() -> argparse.Namespace:
    parser = OneLineParser(prog="film_strip.py", description=__doc__,
                           formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("model", type=Path, metavar="MODEL", help="folder of a training, or its model.glb")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FILE", help="the picture, .png")
    parser.add_argument("--frames", type=count_from_1, default=12, metavar="N", help="number of frames [12]")
    parser.add_argument("--columns", type=count_from_1, default=6, metavar="N", help="frames in a row [6]")
    parser.add_argument("--size", metavar="WIDTHxHEIGHT", help="of a frame, pixels [as the first training camera]")
    parser.add_argument("--mode", default="colour", help="what soup-view shows, such as depth or normals [colour]")
    parser.add_argument("--viewer", metavar="PROGRAM", help="soup-view [build/bin/soup-view, else on PATH]")
    parser.add_argument("--device", help="device of soup-view")
    return parser.parse_args()


def viewer_of(given: str | None) -> str:
    built = Path(__file__).resolve().parent.parent / "build/bin/soup-view"
    found = given or (str(built) if built.is_file() else "soup-view")
    program = shutil.which(found)
    if program is None:
        raise ValueError(f"{found}: no such program; build it, or name it with --viewer")
    return program


def frames_of(options: argparse.Namespace) -> list[Picture]:
    """The frames as soup-view draws them."""
    command = [viewer_of(options.viewer), str(options.model), "--path", "cameras", "--frames", str(options.frames)]
    command += ["--mode", options.mode]
    for name, value in (("--size", options.size), ("--device", options.device)):
        command += [name, value] if value else []
    with tempfile.TemporaryDirectory() as folder:
        run = subprocess.run([*command, "-o", folder], stderr=subprocess.PIPE, text=True, errors="replace")
        if run.returncode:
            lines = run.stderr.strip().splitlines() or [f"ended with status {run.returncode}"]
            raise ValueError(lines[-1])
        return [matplotlib.image.imread(path)[..., :3] for path in sorted(Path(folder).glob("*.png"))]


def strip_of(frames: list[Picture], columns: int) -> Picture:
    """Rows of frames on black, from left to right and from top to bottom."""
    columns = min(columns, len(frames))
    rows = math.ceil(len(frames) / columns)
    height, width = frames[0].shape[:2]
    strip = np.zeros((rows * (height + GAP) + GAP, columns * (width + GAP) + GAP, 3), np.float32)
    for i, frame in enumerate(frames):
        top, left = GAP + i // columns * (height + GAP), GAP + i % columns * (width + GAP)
        strip[top:top + height, left:left + width] = frame
    return strip


def write(path: Path, picture: Picture) -> None:
    """Writes a PNG under another name first, so that a file is whole or absent."""
    partial = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        matplotlib.image.imsave(partial, picture, format="png", metadata={"Software": None})
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)


def main() -> None:
    options = arguments()
    try:
        if options.output.suffix.lower() != ".png":
            raise ValueError(f"{options.output}: pictures are written as PNG; give a name that ends with .png")
        if not options.output.parent.is_dir():
            raise ValueError(f"{options.output.parent}: no such folder; create it first")
        write(options.output, strip_of(frames_of(options), options.columns))
    except OSError as error:
        sys.exit(f"film_strip.py: {error.filename or options.output}: {error.strerror}; check the path")
    except ValueError as error:
        sys.exit(f"film_strip.py: {error}")


if __name__ == "__main__":
    main()
