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
    p = Picture(508, "Architecture: who uses whom")
    programs = [p.box(20, 16, 200, "trainer/", ["soup-train: command line,", "progress"]),
                p.box(240, 16, 200, "viewer/", ["soup-view, and the window", "that soup-train opens"]),
                p.box(460, 16, 200, "tools/", ["soup-eval, soup-bench,", "soup-export"]),
                p.box(680, 16, 200, "web/", ["the viewer for browsers,", "inside soup-export"])]
    train = p.box(20, 126, 420, "engine/train/", ["a step, its schedule, changes of topology,", "checkpoints, evaluation"])
    render = p.box(460, 126, 420, "engine/render/", ["pictures by the rasteriser of a GPU,", "cameras of a viewer"])
    soup = p.box(20, 236, 270, "engine/soup/", ["triangles, textures, MLP, starts,", "model files"])
    scene = p.box(310, 236, 270, "engine/scene/", ["dataset readers, cameras,", "photographs without distortion"])
    image = p.box(600, 236, 280, "engine/image/", ["PNG, JPEG, WebP, TIFF:", "for scene, soup, render, train"])
    gpu = p.box(20, 340, 860, "engine/gpu/", ["device.h: buffers, launch, record, replay, timings. graphics.h: what the rasteriser needs.",
                                              "Backends: vulkan, cuda, host (the CPU's threads), lanes (the same, 4 to 16 at once)"])
    p.box(20, 432, 860, "shaders/", ["one kernel a file, its arguments in args/, the maths of kernels and tests in common/.",
                                     "Compiled as SPIR-V, as CUDA and as C++: one source for every backend"], "shared")
    p.arrow((middle(programs[0]), programs[0][3]), (middle(programs[0]), train[1]))
    p.arrow((middle(programs[1]), programs[1][3]), (middle(programs[1]), 108), (540, 108), (540, render[1]))
    p.arrow((middle(programs[2]), programs[2][3]), (middle(programs[2]), render[1]))
    p.arrow((500, programs[2][3]), (500, 98), (400, 98), (400, train[1]))
    p.arrow((programs[0][2], 50), (programs[1][0], 50))
    p.arrow((150, train[3]), (150, soup[1]))
    p.arrow((380, train[3]), (380, scene[1]))
    p.arrow((480, render[3]), (480, 214), (260, 214), (260, soup[1]))
    p.arrow((300, train[3]), (300, gpu[1]))
    p.arrow((590, render[3]), (590, gpu[1]))
    p.arrow((450, gpu[3]), (450, 432))
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
