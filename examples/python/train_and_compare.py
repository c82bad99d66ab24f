"""Trains two presets on the same scene and compares them view by view.

train_and_compare.py DATASET OUT [STEPS]: writes OUT/fast.glb, OUT/balanced.glb, and the photograph and both renderings
of the first test view beside each other as OUT/compare.npy.
"""

import sys
from pathlib import Path

import numpy as np

import trisoup

dataset, out = sys.argv[1], Path(sys.argv[2])
steps = int(sys.argv[3]) if len(sys.argv) > 3 else None
out.mkdir(parents=True, exist_ok=True)

scene = trisoup.Dataset(dataset)
models = {}
for preset in ("fast", "balanced"):
    training = trisoup.Training(scene, preset, steps=steps, seed=0)
    for progress in training.steps(every=100):
        print(f"{preset}: {progress}")
    models[preset] = training.model()
    models[preset].save(out / f"{preset}.glb")

qualities = {preset: model.evaluate(scene) for preset, model in models.items()}
print(f"{'view':30} " + " ".join(f"{preset:>10}" for preset in models))
for i, view in enumerate(scene.test):
    print(f"{view.name:30} " + " ".join(f"{q.views[i].psnr:7.2f} dB" for q in qualities.values()))
for preset, model in models.items():
    print(f"{preset}: {qualities[preset].mean.psnr:.2f} dB, {model.triangles} triangles, {model.size} bytes")

first = scene.test[0]
pictures = [first.image / np.float32(255)] + [model.render(first.camera) for model in models.values()]
np.save(out / "compare.npy", np.concatenate(pictures, axis=1))
