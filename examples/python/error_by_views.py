"""Divides the error of a model's test views by what the training views tell about their pixels.

error_by_views.py DATASET MODEL [RESOLUTION]: a row for pixels whose surface no training view shows unhidden, one shows,
several show but all from one side, and several show with the test camera between them. PSNR is that of all such pixels
together, in the exposures that the model foretells.
"""

import sys

import numpy as np
from numpy.typing import NDArray

import trisoup

TOLERANCE = 0.03  # of a depth, as in soup-eval's co-visibility
ROWS = ("shown by none", "by one", "by several, from one side", "by several, on both sides")

Floats = NDArray[np.float64]


def surface(camera: trisoup.Camera, depth: Floats) -> Floats:
    """World positions of what the pixels show, (height * width, 3); not finite where they show nothing."""
    x, y = np.meshgrid(np.arange(camera.width) + 0.5, np.arange(camera.height) + 0.5)
    seen = np.stack([(x - camera.cx) / camera.fx, (y - camera.cy) / camera.fy, np.ones_like(x)], -1) * depth[..., None]
    pose = camera.world_to_camera
    return (seen.reshape(-1, 3) - pose[:3, 3]) @ pose[:3, :3]


def shown_by(camera: trisoup.Camera, depth: Floats, points: Floats) -> NDArray[np.bool_]:
    """Whether one of the four pixels around each point's place in the view has its depth."""
    pose = camera.world_to_camera
    local = points @ pose[:3, :3].T + pose[:3, 3]
    z = local[:, 2]
    x, y = camera.fx * local[:, 0] / z + camera.cx, camera.fy * local[:, 1] / z + camera.cy
    inside = (z > 0) & (x >= 0) & (y >= 0) & (x < camera.width) & (y < camera.height)
    left, top = (np.floor(np.where(inside, c, 0) - 0.5).astype(int) for c in (x, y))
    shown = np.zeros(len(points), bool)
    for i in (0, 1):
        for j in (0, 1):
            seen = depth[np.clip(top + j, 0, camera.height - 1), np.clip(left + i, 0, camera.width - 1)]
            shown |= np.abs(seen - z) <= TOLERANCE * z
    return inside & shown


def directions(points: Floats, camera: trisoup.Camera) -> Floats:
    """Unit vectors from the points to the camera."""
    pose = camera.world_to_camera
    to = -pose[:3, :3].T @ pose[:3, 3] - points
    return to / np.linalg.norm(to, axis=1, keepdims=True)


def row_of_pixels(
        camera: trisoup.Camera, points: Floats, train: list[tuple[trisoup.Camera, Floats]]) -> NDArray[np.int64]:
    """The number in ROWS of each pixel. A test camera is between views if one lies, within 60 degrees, on the side away
    from the nearest one, as seen from the surface."""
    own = directions(points, camera)
    count, nearest, closest = np.zeros(len(points), int), np.zeros_like(points), np.full(len(points), -2.0)
    witnesses = []
    for other, depth in train:
        shown = shown_by(other, depth, points)
        to = directions(points, other)
        cosine = np.where(shown, (to * own).sum(1), -2)
        nearest = np.where((cosine > closest)[:, None], to, nearest)
        closest = np.maximum(closest, cosine)
        count += shown
        witnesses.append((shown, to))
    away, between = own - nearest, np.zeros(len(points), bool)
    for shown, to in witnesses:
        further = to - own
        cosine = (away * further).sum(1)
        between |= shown & (cosine >= 0.5 * np.linalg.norm(away, axis=1) * np.linalg.norm(further, axis=1))
    return np.where(count < 2, count, np.where(between, 3, 2))


def main() -> None:
    resolution = float(sys.argv[3]) if len(sys.argv) > 3 else 1
    scene, model = trisoup.Dataset(sys.argv[1], resolution=resolution), trisoup.Model.load(sys.argv[2])
    train = [(view.camera, model.render(view.camera, "depth").astype(float)) for view in scene.train]
    pixels, squares = np.zeros(len(ROWS)), np.zeros(len(ROWS))
    for view in scene.test:
        colour, depth = model.render(view.camera, ("colour", "depth"))
        odds = np.exp(model.exposure(view))
        colour = odds * colour / (1 + (odds - 1) * colour)
        error = ((np.clip(colour, 0, 1) - view.image[..., :3] / 255) ** 2).mean(-1).ravel()
        with np.errstate(invalid="ignore", divide="ignore"):  # pixels without a triangle are at infinity
            row = row_of_pixels(view.camera, surface(view.camera, depth.astype(float)), train)
        counts = np.ones(len(row), bool) if view.mask is None else view.mask.ravel() > 0
        pixels += np.bincount(row[counts], minlength=len(ROWS))
        squares += np.bincount(row[counts], error[counts], len(ROWS))
    print(f"{'surface':28}{'pixels':>8}{'error':>8}{'PSNR':>10}")
    for name, n, sum_of_squares in zip(ROWS, pixels, squares):
        psnr = f"{-10 * np.log10(sum_of_squares / n):7.2f} dB" if n else "-"
        print(f"{name:28}{n / pixels.sum():8.1%}{sum_of_squares / squares.sum():8.1%}{psnr:>10}")


if __name__ == "__main__":
    main()
