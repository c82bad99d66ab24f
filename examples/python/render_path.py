"""Renders a circle around a soup into arrays.

render_path.py MODEL OUT [FRAMES]: writes OUT/NNN.npy, (height, width, 4) float32 with depth as fourth channel.
"""

import sys
from pathlib import Path

import numpy as np

import trisoup

model, out = trisoup.Model.load(sys.argv[1]), Path(sys.argv[2])
frames = int(sys.argv[3]) if len(sys.argv) > 3 else 120
out.mkdir(parents=True, exist_ok=True)

# The training's cameras look at the scene's centre, whose up direction is against their y axes on average.
poses = np.array([view.camera.world_to_camera for view in model.cameras])
eyes = -np.einsum("nij,ni->nj", poses[:, :3, :3], poses[:, :3, 3])
up = -poses[:, 1, :3].mean(axis=0)
up /= np.linalg.norm(up)
target = model.centre
offset = (eyes - target).mean(axis=0) @ up * up
radius = np.linalg.norm(eyes - target - offset, axis=1).mean()
side = np.cross(up, np.eye(3)[np.abs(up).argmin()])
side /= np.linalg.norm(side)
ahead = np.cross(side, up)

for i in range(frames):
    angle = 2 * np.pi * i / frames
    eye = target + offset + radius * (np.cos(angle) * side + np.sin(angle) * ahead)
    camera = trisoup.Camera.look_at(eye, target, up, fov=40, width=320, height=240)
    colour, depth = model.render(camera, ("colour", "depth"))
    np.save(out / f"{i:03}.npy", np.dstack([colour, depth]))
print(f"{frames} pictures in {out}")
