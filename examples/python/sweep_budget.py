"""Quality over the budget of triangles, as a chart.

sweep_budget.py DATASET CHART [STEPS [BUDGET...]]: writes CHART (.png, .svg, .pdf). Needs matplotlib.
"""

import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

import trisoup

dataset, chart = sys.argv[1:3]
steps = int(sys.argv[3]) if len(sys.argv) > 3 else 1000
budgets = [int(text) for text in sys.argv[4:]] or [250, 500, 1000, 2000, 4000]

scene = trisoup.Dataset(dataset)
psnr, size = [], []
for budget in budgets:
    training = trisoup.Training(scene, "fast", steps=steps, triangles=budget)
    training.run()
    model = training.model()
    psnr.append(model.evaluate(scene).mean.psnr)
    size.append(model.size / 1e6)
    print(f"{budget} triangles: {psnr[-1]:.2f} dB, {size[-1]:.2f} MB")

figure, axes = plt.subplots(figsize=(5, 3.5), layout="constrained")
axes.plot(budgets, psnr, marker="o")
for x, y, megabytes in zip(budgets, psnr, size):
    axes.annotate(f"{megabytes:.2f} MB", (x, y), textcoords="offset points", xytext=(4, -10), fontsize=8)
axes.set(xscale="log", xlabel="triangles", ylabel="PSNR of the test views, dB")
figure.savefig(chart)
