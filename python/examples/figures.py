#!/usr/bin/python3
"""The usual figures of a run, from its result directory: height and front, energies, surfaces over time, stress by depth.

    python3 python/examples/figures.py results/bank [-o figures]

Read it from top to bottom as a notebook: each block stands for itself. Needs matplotlib.
"""
import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # files, no window
import matplotlib.pyplot as plt
import numpy as np

import kuzure

options = argparse.ArgumentParser(description=__doc__.split("\n")[0])
options.add_argument("directory", help="the result directory of a run")
options.add_argument("-o", "--output", help="where figures go (default: DIRECTORY/figures)")
asked = options.parse_args()

run = kuzure.Run(asked.directory)
out = Path(asked.output or run.directory / "figures")
out.mkdir(parents=True, exist_ok=True)


def save(figure, name):
    figure.tight_layout()
    figure.savefig(out / f"{name}.png", dpi=110)
    plt.close(figure)
    print(out / f"{name}.png")


# ---- how high it stands and how far it reaches
figure, axes = plt.subplots(figsize=(6, 3.6))
run.plot("height", "front_max_x", axes=axes)
axes.set_title(run.snapshot(0).title, fontsize=9)
save(figure, "height_and_front")

# ---- where the energy went
figure, axes = plt.subplots(figsize=(6, 3.6))
run.plot("kinetic", "potential", "elastic", "plastic", "viscous", "stabilising", axes=axes)
save(figure, "energies")

# ---- the surface at a few times
figure, axes = plt.subplots(figsize=(6, 3.6))
times = run.snapshots.times
for t in times[np.unique(np.linspace(0, len(times) - 1, 5).astype(int))]:
    s = run.surface(t)
    axes.plot(s.at, s.height, label=f"{s.time:.2f} s")
axes.set_xlabel("distance from the axis (m)" if s.spread == "radial" else "x (m)")
axes.set_ylabel("height (m)")
axes.set_title(f"run-out {s.runout:.3g} m, greatest height {s.top:.3g} m", fontsize=9)
axes.legend()
save(figure, "surface")

# ---- the soil at the end, coloured by what it suffered
last = run.snapshot()
x, _, z = last["position"].T
figure, axes = plt.subplots(figsize=(6, 3.6))
strain = last["plastic_strain"] if "plastic_strain" in last else np.linalg.norm(last["displacement"], axis=1)
points = axes.scatter(x, z, c=strain, s=2, cmap="viridis", linewidths=0, vmax=np.percentile(strain, 99))
figure.colorbar(
    points, orientation="horizontal", extend="max", label="plastic strain (1)" if "plastic_strain" in last else "displacement (m)"
)
axes.set_aspect("equal")
axes.set_xlabel("x (m)")
axes.set_ylabel("z (m)")
save(figure, "plastic_strain")

# ---- vertical stress by depth at the start and at the end
if "stress" in last:
    figure, axes = plt.subplots(figsize=(4.4, 3.6))
    for s in (run.snapshot(0), last):
        axes.scatter(1e-3 * s["stress_zz"], s["position"][:, 2], s=2, linewidths=0, label=f"{s.time:.2f} s")
    axes.set_xlabel("vertical stress (kPa), tension positive")
    axes.set_ylabel("z (m)")
    axes.legend(markerscale=4)
    save(figure, "stress")
