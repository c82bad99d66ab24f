#!/usr/bin/env python3
"""Draws architecture.svg and step.svg of the documentation."""

from __future__ import annotations

import argparse
import html
import sys
from pathlib import Path
from typing import NamedTuple, Sequence

WIDTH = 900
LINE = 17  # height of a line of text
PAD = 10  # within a box
GAP = 14  # between boxes
ROOT = Path(__file__).resolve().parent.parent
STYLE = (
    "<style>\n"
    "  svg { background: #ffffff; font-family: sans-serif; font-size: 13px; }\n"
    "  rect { fill: #eef3f8; stroke: #5b7a99; } rect.shared { fill: #f8f0e0; stroke: #a58446; } "
    "rect.state { fill: #eaf5ea; stroke: #5d9160; }\n"
    "  text { fill: #202020; } text.title { font-weight: bold; } "
    "path { stroke: #555555; fill: none; stroke-width: 1.3; }\n"
    "  marker path { stroke: none; fill: #555555; }\n"
    "</style>\n"
    '<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" markerHeight="8" orient="auto">\n'
    '  <path d="M0 0 L8 4 L0 8 z"/></marker></defs>\n')

Point = tuple[float, float]


class Box(NamedTuple):
    left: float
    top: float
    right: float
    bottom: float

    @property
    def middle(self) -> float:
        return (self.left + self.right) / 2


class Picture:
    """An SVG picture of boxes and arrows."""

    def __init__(self, height: int, title: str) -> None:
        self.height, self.title = height, title
        self.parts: list[str] = []

    def box(self, x: float, y: float, width: float, title: str, lines: Sequence[str], kind: str = "") -> Box:
        """A box with a bold title and lines of text. kind: class of the style."""
        height = box_height(len(lines))
        self.parts.append(f'<rect class="{kind}" x="{x}" y="{y}" width="{width}" height="{height}" rx="5"/>')
        for i, line in enumerate((title, *lines)):
            self.text(x + PAD, y + PAD + 11 + LINE * i, line, "title" if i == 0 else "")
        return Box(x, y, x + width, y + height)

    def text(self, x: float, y: float, text: str, kind: str = "") -> None:
        self.parts.append(f'<text class="{kind}" x="{x}" y="{y}">{html.escape(text)}</text>')

    def arrow(self, *points: Point) -> None:
        path = "L".join(f"{x} {y}" for x, y in points)
        self.parts.append(f'<path d="M{path}" marker-end="url(#tip)"/>')

    def write(self, path: Path) -> None:
        size = f'viewBox="0 0 {WIDTH} {self.height}" width="{WIDTH}" height="{self.height}"'
        head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="img" aria-label="{html.escape(self.title)}">\n'
        path.write_text(head + STYLE + "\n".join(self.parts) + "\n</svg>\n")


def box_height(lines: int) -> int:
    return 2 * PAD + LINE * (1 + lines) - 4


class Folder(NamedTuple):
    name: str
    contents: list[str]


LAYERS = [
    [Folder("trainer/", ["soup-train, soup-simplify"]),
     Folder("tools/", ["soup-edit, soup-eval,", "soup-export, soup-bench"]),
     Folder("viewer/", ["soup-view, window of", "soup-train"]),
     Folder("cli/, pages/, web/", ["shared options, web pages,", "viewer for browsers"])],
    [Folder("python/", ["the Python module"]),
     Folder("engine/api/", ["public C++ interface"]),
     Folder("engine/run/", ["training loop, presets, checkpoints,", "output folder"])],
    [Folder("engine/train/", [
        "config: settings and schedule", "step: one training step", "start: initial triangles",
        "topology: refinement, importance, simplification", "quality: metrics"])],
    [Folder("engine/render/", ["real-time renderer, cameras"]),
     Folder("engine/format/", ["model.glb, safetensors, colliders"]),
     Folder("engine/ranks/", ["MPI"])],
    [Folder("engine/soup/", ["triangles, textures, MLP"]),
     Folder("engine/mesh/", ["surfaces, decimation, mesh files"]),
     Folder("engine/scene/", ["datasets, cameras, undistortion"])],
    [Folder("engine/gpu/", ["device interface; backends vulkan, cuda,", "host (CPU), lanes (CPU vectors)"]),
     Folder("engine/image/", ["PNG, JPEG, WebP, TIFF"]),
     Folder("engine/base/", ["files, errors, threads"])],
    [Folder("shaders/", [
        "one kernel per file, arguments in args/, formulas in common/;", "compiled as SPIR-V, CUDA and C++"])],
]


def architecture() -> Picture:
    p = Picture(622, "Architecture: folders use folders of lower rows, or to their right")
    p.text(20, 22, "A folder uses folders of lower rows, or to its right. In engine/train/ it uses those above it.")
    y = 36
    for layer in LAYERS:
        width = (WIDTH - 40 - GAP * (len(layer) - 1)) / len(layer)
        lines = max(len(folder.contents) for folder in layer)
        kind = "shared" if layer[0].name == "shaders/" else ""
        for i, folder in enumerate(layer):
            padding = [""] * (lines - len(folder.contents))
            p.box(20 + i * (width + GAP), y, width, folder.name, folder.contents + padding, kind)
        y += box_height(lines) + GAP
    return p


def step() -> Picture:
    p = Picture(700, "The data of one training step")
    left, centre, right, width = 20, 310, 620, 250

    def box(x: int, y: int, title: str, lines: Sequence[str], kind: str = "") -> Box:
        return p.box(x, y, width, title, lines, kind)
    soup = box(left, 16, "soup", ["vertices, texture levels (logits),", "MLP, moments of Adam"], "state")
    batch = box(right, 16, "batch (BatchBuffers)",
                ["cameras, photographs (8 bits),", "random keys: begin_step"], "state")
    visibility = box(centre, 16, "project, bin, bin_scan",
                     ["clip coordinates, list of triangles", "per tile of 8 x 8 pixels"])
    hits = box(centre, 110, "visibility", ["per pixel: triangle, barycentrics,", "depth (hits)"])
    shade = box(centre, 204, "shade", ["texture, view direction, MLP:", "colour"])
    photos = box(right, 204, "sample_photographs, expose",
                 ["photographs at the sampled positions;", "measure_motion: errors of poses"])
    loss = box(centre, 298, "ssim, loss_gradient", ["0.8 L1 + 0.1 (1 - SSIM):", "gradient by colour"])
    order = box(right, 392, "count_visible, place_pixels", ["pixels sorted by triangle"])
    mlp = box(centre, 392, "shade_backward", ["gradients of features per pixel", "and of the MLP"])
    edges = box(left, 392, "edge_forces, depth_gradient",
                ["differences of neighbouring pixels,", "depth maps: gradients of vertices"])
    opacity = box(centre, 486, "opacity_backward",
                  ["likelihood ratio over the tile lists:", "gradients of opacities"])
    textures = box(centre, 590, "update_textures", ["one workgroup per triangle:", "all levels, Adam, sigmoid"])
    vertices = box(left, 590, "update_vertices", ["VectorAdam"])
    weights = box(right, 590, "update_mlp", ["Adam"])

    for above, below in ((visibility, hits), (hits, shade), (shade, loss), (loss, mlp), (opacity, textures)):
        p.arrow((above.middle, above.bottom), (below.middle, below.top))
    p.arrow((soup.right, 46), (visibility.left, 46))
    p.arrow((batch.left, 46), (visibility.right, 46))
    p.arrow((soup.middle, soup.bottom), (soup.middle, 235), (shade.left, 235))
    p.arrow((745, batch.bottom), (745, photos.top))
    p.arrow((745, photos.bottom), (745, 328), (loss.right, 328))
    p.arrow((hits.right, 140), (885, 140), (885, 376), (745, 376), (745, order.top))
    p.arrow((order.left, 422), (mlp.right, 422))
    p.arrow((loss.left, 328), (145, 328), (145, edges.top))
    p.arrow((loss.left + 15, loss.bottom), (loss.left + 15, 376), (295, 376), (295, 516), (opacity.left, 516))
    p.arrow((edges.left + 125, edges.bottom), (145, vertices.top))
    p.arrow((mlp.right - 20, mlp.bottom), (mlp.right - 20, 472), (745, 472), (745, weights.top))
    p.arrow((mlp.right - 60, mlp.bottom), (mlp.right - 60, 480), (590, 480), (590, 572), (500, 572),
            (500, textures.top))
    p.text(20, 688, "Green: input and parameters. Blue: one or more kernels. "
                    "Arrows: arrays in device memory.")
    return p


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=ROOT / "docs", help="folder for the pictures [docs]")
    folder = parser.parse_args().folder
    if not folder.is_dir():
        print(f"draw_diagrams.py: {folder}: no such folder; create it first", file=sys.stderr)
        return 1
    architecture().write(folder / "architecture.svg")
    step().write(folder / "step.svg")
    return 0


if __name__ == "__main__":
    sys.exit(main())
