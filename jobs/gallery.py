#!/usr/bin/python3
"""The pictures of docs/gallery.md: runs every scene of the gallery, unless its results are there, and makes docs/figures/gallery_NAME.png
of the moment that shows most. Ends with a table of what the runs took.

    python3 jobs/gallery.py [results/gallery]      needs python3-pil; three minutes on two cores
"""
import sys
from pathlib import Path

from PIL import Image

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "python"))
import kuzure

# Name: time of the picture (s), other colours or view than the scene's. hirata_52 at twice its spacing, with a floor as thick in layers.
COARSE_HIRATA = {"space.spacing": 0.08, "time.step": 2e-4, "wall.0.box.low": [0.0, 0.0, -0.32]}
SCENES = {
    "bank": (1.5, {}),
    "slope": (6.0, {}),
    "layered_slope": (4.0, {}),
    "sensitive_clay": (6.0, {}),
    "aluminium_bars": (0.6, {}),
    "column": (0.35, {}),
    "cylinder": (0.35, {}),
    "silo": (0.7, {}),
    "pier": (0.5, {}),
    "gravity_wall": (2.0, {}),
    "chute": (1.0, {}),
    "embankment": (2.4, {}),
    "gate": (0.9, {}),
    "excavation": (6.0, {}),
    "rain": (10.0, {}),
    "active_wall": (1.9, {}),
    "passive_wall": (2.7, {}),
    "footing": (9.0, {}),
    "hirata_52": (0.5, COARSE_HIRATA),
}
WIDTH, MOST_BYTES = 720, 60000


def thumbnail(picture, file):
    """The picture with fewer pixels and colours, within the bytes."""
    image = Image.open(picture).convert("RGB")
    image = image.resize((WIDTH, round(WIDTH * image.height / image.width)), Image.LANCZOS)
    for colors in (128, 64, 32, 16):
        # by the largest coverage, since by median cut what is rare becomes brown like the walls: the yellow of shear bands
        image.quantize(colors, method=Image.MAXCOVERAGE, kmeans=3, dither=Image.NONE).save(file, optimize=True)
        if file.stat().st_size < MOST_BYTES:
            return
    raise SystemExit(f"{file}: {file.stat().st_size} bytes, more than {MOST_BYTES}")


def main():
    results = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "results/gallery")
    for name, (t, sets) in SCENES.items():
        where = results / name
        run = kuzure.Run(where) if where.exists() else kuzure.run(ROOT / f"jobs/scenes/{name}.toml", where, **sets)
        number = min(range(len(run.snapshots)), key=lambda k: abs(run.snapshots[k].time - t))
        thumbnail(where / f"picture_{number:06d}.png", ROOT / f"docs/figures/gallery_{name}.png")
        s = run.summary
        print(f"{name:16} {s['soil_particles']:7} particles {s['steps']:6} steps {s['wall_seconds']:6.1f} s  {s['warnings']}", flush=True)


if __name__ == "__main__":
    main()
