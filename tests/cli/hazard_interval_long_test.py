#!/usr/bin/python3
"""Does the interval of resolution hold what finer runs find? Ten scenes without [uncertain], so that resolution alone is in question: the
answer of 4 and 6 layers against a run of 9. As hazard_interval_long_test.py PROGRAM FILE.json the table is written there (docs/hazard.md)."""
import json
import os
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, root, scratch
from runs import Runs

COARSE, FINEST, AT_LEAST = "4,4,6", "9", 8
HEAP = """title = "a column on a floor"
dimensions = 3
[space]
spacing = 0.5
[time]
end = 4.0
[soil.debris]
density = 1800.0
young = 2.0e7
poisson = 0.3
friction_angle = 30.0
[[body]]
soil = "debris"
box = { low = [0.0, 0.0, 0.0], high = [6.0, 6.0, 6.0] }
stress = "at rest"
[[wall]]
box = { low = [-12.0, -12.0, -2.0], high = [18.0, 18.0, 0.0] }
surface = { friction_angle = 24.0 }
[effects]
gravity = [0.0, 0.0, -9.81]
viscosity = { alpha = 0.1 }
[maps]
cell = 1.0
"""


def scenes(ground):
    """Name and text of each."""
    text = {name: open(os.path.join(ground, name + ".toml")).read() for name in ("slope", "gully")}
    bed, soil, thick = "friction = 24.0\n", "friction_angle = 30.0\n", "thickness = 3.0"
    for name, of in text.items():
        for words in (bed, soil, thick):
            assert of.count(words) == 1, (name, words)
        text[name] = of[: of.index("[output]")]
    yield "slope", text["slope"]
    yield "slope, bed 20 deg", text["slope"].replace(bed, "friction = 20.0\n")
    yield "slope, bed 28 deg", text["slope"].replace(bed, "friction = 28.0\n")
    yield "slope, soil 38 deg", text["slope"].replace(soil, "friction_angle = 38.0\n")
    yield "slope, cohesion 2 kPa", text["slope"].replace(soil, soil + "cohesion = 2000.0\n")
    yield "slope, 2 m thick", text["slope"].replace(thick, "thickness = 2.0")
    yield "gully", text["gully"]
    yield "gully, bed 20 deg", text["gully"].replace(bed, "friction = 20.0\n")
    yield "gully, bed 28 deg", text["gully"].replace(bed, "friction = 28.0\n")
    yield "column on a floor", HEAP


def main():
    work = scratch("hazard-interval")
    runs = Runs(work)
    ground = os.path.join(root, "jobs", "ground")
    for file in os.listdir(ground):
        if not file.endswith((".py", ".toml")):
            shutil.copy(os.path.join(ground, file), work)

    def reach_of(name, layers, out):
        runs.call("hazard", name + ".toml", "--within", "10h", "--layers", layers, "-o", out, timeout=3600)
        return runs.json(out, "hazard.json")["reach"]

    table = []
    for k, (title, text) in enumerate(scenes(ground)):
        name = f"scene{k}"
        runs.scene(name, text)
        answer, finest = reach_of(name, COARSE, f"answer{k}"), reach_of(name, FINEST, f"finest{k}")
        row = {"scene": title, "low": answer["low"], "likely": answer["likely"], "high": answer["high"], "finest": finest["likely"]}
        row["inside"] = answer["low"] <= finest["likely"] <= answer["high"]
        print(
            f"{title:24} {row['low']:7.2f} {row['likely']:7.2f} {row['high']:7.2f}   finest {row['finest']:7.2f} {'' if row['inside'] else 'OUTSIDE'}",
            flush=True,
        )
        table.append(row)
        if len(sys.argv) > 2:
            with open(sys.argv[2], "w") as f:
                json.dump(table, f, indent=1)
    inside = sum(row["inside"] for row in table)
    check(inside >= AT_LEAST, f"the interval holds the finest reach in {inside} of {len(table)} scenes, of which {AT_LEAST} are asked for")
    check(all(row["low"] < row["high"] for row in table), "no interval is empty")
    finish()


if __name__ == "__main__":
    main()
