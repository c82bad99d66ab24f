#!/usr/bin/env python3
"""draw_diagrams.py [FOLDER]: writes architecture.svg and step.svg into FOLDER, docs/ where none is named."""
import html
import pathlib
import sys

WIDTH, LINE, PAD = 900, 17, 10
STYLE = """<style>
  svg { background: #ffffff; font-family: sans-serif; font-size: 13px; }
  rect { fill: #eef3f8; stroke: #5b7a99; } rect.shared { fill: #f8f0e0; stroke: #a58446; } rect.state { fill: #eaf5ea; stroke: #5d9160; }
  text { fill: #202020; } text.title { font-weight: bold; } path { stroke: #555555; fill: none; stroke-width: 1.3; }
  marker path { stroke: none; fill: #555555; }
</style>
<defs><marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="8" markerHeight="8" orient="auto">
  <path d="M0 0 L8 4 L0 8 z"/></marker></defs>
"""


class Picture:
    def __init__(self, height, title):
        self.height, self.title, self.parts = height, title, []

    def box(self, x, y, width, title, lines=(), kind=""):
        """A box with a bold title and lines of text below; returns its left, top, right and bottom."""
        height = 2 * PAD + LINE * (1 + len(lines)) - 4
        self.parts.append(f'<rect class="{kind}" x="{x}" y="{y}" width="{width}" height="{height}" rx="5"/>')
        for i, line in enumerate((title, *lines)):
            self.text(x + PAD, y + PAD + 11 + LINE * i, line, "title" if i == 0 else "")
        return x, y, x + width, y + height

    def text(self, x, y, text, kind=""):
        self.parts.append(f'<text class="{kind}" x="{x}" y="{y}">{html.escape(text)}</text>')

    def arrow(self, *points):
        path = "L".join(f"{x} {y}" for x, y in points)
        self.parts.append(f'<path d="M{path}" marker-end="url(#tip)"/>')

    def write(self, path):
        size = f'viewBox="0 0 {WIDTH} {self.height}" width="{WIDTH}" height="{self.height}"'
        head = f'<svg xmlns="http://www.w3.org/2000/svg" {size} role="img" aria-label="{html.escape(self.title)}">\n'
        path.write_text(head + STYLE + "\n".join(self.parts) + "\n</svg>\n")


def middle(box):
    return (box[0] + box[2]) / 2


def architecture():
    p = Picture(622, "Architecture: folders use folders of lower rows, or to their right")
    p.text(20, 22, "A folder uses folders of lower rows, or to its right. In engine/train/ it uses those above it.")
    rows = [
        [("trainer/", ["soup-train, soup-simplify"]),
         ("tools/", ["soup-eval, soup-export,", "soup-bench"]),
         ("viewer/", ["soup-view, window of", "soup-train"]),
         ("cli/, pages/, web/", ["shared options, web pages,", "viewer for browsers"])],
        [("engine/api/", ["public C++ interface"]),
         ("engine/run/", ["training loop, presets, checkpoints,", "output folder"])],
        [("engine/train/", ["config: settings and schedule", "step: one training step", "start: initial triangles",
                            "topology: refinement, importance, simplification", "quality: metrics"])],
        [("engine/render/", ["real-time renderer, cameras"]),
         ("engine/format/", ["model.glb, safetensors, colliders"]),
         ("engine/ranks/", ["MPI"])],
        [("engine/soup/", ["triangles, textures, MLP"]),
         ("engine/mesh/", ["surfaces, decimation, mesh files"]),
         ("engine/scene/", ["datasets, cameras, undistortion"])],
        [("engine/gpu/", ["device interface; backends vulkan, cuda,", "host (CPU), lanes (CPU vectors)"]),
         ("engine/image/", ["PNG, JPEG, WebP, TIFF"]),
         ("engine/base/", ["files, errors, threads"])],
        [("shaders/", ["one kernel per file, arguments in args/, formulas in common/;",
                       "compiled as SPIR-V, CUDA and C++"])],
    ]
    gap, y = 14, 36
    for row in rows:
        width = (WIDTH - 40 - gap * (len(row) - 1)) / len(row)
        most = max(len(lines) for _, lines in row)
        kind = "shared" if row[0][0] == "shaders/" else ""
        for i, (title, lines) in enumerate(row):
            p.box(20 + i * (width + gap), y, width, title, lines + [""] * (most - len(lines)), kind)
        y += 2 * PAD + LINE * (1 + most) - 4 + gap
    return p


def step():
    p = Picture(700, "The data of one training step")
    w = 250
    soup = p.box(20, 16, w, "the soup", ["corners, texture levels (logits),", "MLP, Adam's moments"], "state")
    batch = p.box(620, 16, w, "a batch", ["cameras, photographs (8 bits),", "random keys: begin_step"], "state")
    visibility = p.box(310, 16, w, "project, bin, bin_scan", ["clip coordinates, lists of triangles", "for each tile of 8 x 8 pixels"])
    hits = p.box(310, 110, w, "visibility", ["per pixel: triangle, barycentrics,", "depth (hits)"])
    shade = p.box(310, 204, w, "shade", ["texture, view direction, MLP:", "colour"])
    photos = p.box(620, 204, w, "sample_photographs, expose", ["photographs where the step looks,", "with their exposures"])
    loss = p.box(310, 298, w, "ssim, loss_gradient", ["0.8 L1 + 0.1 (1 - SSIM):", "gradient by colour"])
    order = p.box(620, 392, w, "count_visible, place_pixels", ["places of a triangle's pixels,", "side by side"])
    mlp = p.box(310, 392, w, "shade_backward", ["gradients of features by pixel,", "sorted, and of the MLP"])
    edges = p.box(20, 392, w, "edge_forces", ["differences of neighbouring pixels:", "gradients of corners"])
    opacity = p.box(310, 486, w, "opacity_backward", ["likelihood ratio over the same lists:", "gradients of opacities"])
    textures = p.box(310, 590, w, "update_textures", ["a workgroup a triangle: all levels,", "Adam, sigmoid"])
    vertices = p.box(20, 590, w, "update_vertices", ["VectorAdam"])
    weights = p.box(620, 590, w, "update_mlp", ["Adam"])
    x = middle(visibility)
    for above, below in ((visibility, hits), (hits, shade), (shade, loss), (loss, mlp), (opacity, textures)):
        p.arrow((x, above[3]), (x, below[1]))
    p.arrow((soup[2], 46), (visibility[0], 46))
    p.arrow((batch[0], 46), (visibility[2], 46))
    p.arrow((middle(soup), soup[3]), (middle(soup), 235), (shade[0], 235))
    p.arrow((745, batch[3]), (745, photos[1]))
    p.arrow((745, photos[3]), (745, 328), (loss[2], 328))
    p.arrow((hits[2], 140), (885, 140), (885, 376), (745, 376), (745, order[1]))
    p.arrow((order[0], 422), (mlp[2], 422))
    p.arrow((loss[0], 328), (145, 328), (145, edges[1]))
    p.arrow((loss[0] + 15, loss[3]), (loss[0] + 15, 376), (295, 376), (295, 516), (opacity[0], 516))
    p.arrow((edges[0] + 125, edges[3]), (145, vertices[1]))
    p.arrow((mlp[2] - 20, mlp[3]), (mlp[2] - 20, 472), (745, 472), (745, weights[1]))
    p.arrow((mlp[2] - 60, mlp[3]), (mlp[2] - 60, 480), (590, 480), (590, 572), (500, 572), (500, textures[1]))
    p.text(20, 688, "Green: what a step reads and changes. Each blue box is one kernel or several; arrows are arrays in device memory.")
    return p


def main():
    if len(sys.argv) > 2 or (len(sys.argv) == 2 and sys.argv[1].startswith("-")):
        print(__doc__)
        return 0 if sys.argv[1] in ("-h", "--help") else 2
    folder = pathlib.Path(sys.argv[1]) if len(sys.argv) == 2 else pathlib.Path(__file__).resolve().parent.parent / "docs"
    if not folder.is_dir():
        print(f"draw_diagrams.py: {folder}: no such folder; make it first", file=sys.stderr)
        return 1
    architecture().write(folder / "architecture.svg")
    step().write(folder / "step.svg")
    return 0


sys.exit(main())
