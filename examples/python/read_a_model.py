"""Reads all numbers of a model, and writes its triangles as an OBJ file.

read_a_model.py MODEL OBJ
"""

import sys
from pathlib import Path

import numpy as np

import trisoup

model = trisoup.Model.load(sys.argv[1])
print(f"{model}, trained for {(model.settings or {}).get('steps')} steps")

corners = model.vertices.astype(np.float64) + model.origin
areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
print(f"triangles: areas from {areas.min():.3g} to {areas.max():.3g}, in total {areas.sum():.3g}")

# Row i of `features` belongs to the triangle whose range of samples contains i.
samples = np.diff(np.append(model.texture_offsets, len(model.features)))
opacity = np.add.reduceat(model.features[:, 7], model.texture_offsets) / samples
for level in range(6):
    of_level = model.texture_levels == level
    if of_level.any():
        print(f"level {level}: {of_level.sum()} triangles of {samples[of_level][0]} samples, "
              f"mean opacity {opacity[of_level].mean():.3f}")
for i, (weights, bias) in enumerate(model.mlp):
    print(f"MLP layer {i}: {weights.shape[1]} -> {weights.shape[0]}, largest weight {np.abs(weights).max():.3f}")
for view in model.cameras[:3]:
    print(f"camera {view.name}: {view.camera}")

with Path(sys.argv[2]).open("w") as obj:
    for vertex in corners.reshape(-1, 3):
        obj.write("v {} {} {}\n".format(*vertex))
    for face in model.faces + 1:
        obj.write("f {} {} {}\n".format(*face))
