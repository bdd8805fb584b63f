#!/usr/bin/python3
"""Predicted against actual wall time of six scenes; run it on a quiet machine.

    perf/prediction.py [PROGRAM] [--threads N]

Each scene is run as a user would run it; both times are those that `kuzure run` keeps in summary.json. Prints one line a scene
and the median of |predicted/actual - 1|; exits 1 if that is above 20 %. About six minutes on two cores."""
import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PLANE = """title = "plane column"
dimensions = 2
[space]
spacing = 0.005
[time]
end = 0.6
[soil.sand]
density = 1850.0
young = 1.8e6
poisson = 0.3
friction_angle = 25.0
[[body]]
soil = "sand"
box = { low = [0.0, 0.0, 0.0], high = [0.5, 0.0, 0.5] }
[[wall]]
box = { low = [-0.8, 0.0, -0.03], high = [1.3, 0.0, 0.0] }
[effects]
gravity = [0.0, 0.0, -9.81]
viscosity = { alpha = 0.1, beta = 0.0 }
[output]
every = 0.1
history = 0.002
"""
SCENES = [  # name, scene, settings
    ("quickstart, 20^3", "jobs/scenes/quickstart.toml", []),
    ("hirata_52, a tenth of it", "jobs/scenes/hirata_52.toml", ["time.end=0.1"]),
    ("hirata_52 mixed, a tenth", "jobs/scenes/hirata_52.toml", ["time.end=0.1", 'accuracy.precision="mixed"']),
    (
        "20^3 cohesive, artificial stress",
        "jobs/scenes/quickstart.toml",
        ["time.end=0.3", "soil.sand.cohesion=2e3", "effects.artificial_stress={ epsilon = 0.5, exponent = 2.55 }"],
    ),
    ("20^3, step follows, corrected", "jobs/scenes/quickstart.toml", ["time.end=0.3", "!time.step", 'accuracy.correction="gradient"']),
    ("plane column, 100 x 100", PLANE, []),
]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", nargs="?", default=ROOT + "/build/release/kuzure")
    parser.add_argument("--threads", default=str(len(os.sched_getaffinity(0))))
    a = parser.parse_args()
    off = []
    print(f"{'scene':34}{'predicted s':>12}{'interval':>18}{'actual s':>10}{'off':>8}")
    for name, scene, settings in SCENES:
        with tempfile.TemporaryDirectory(prefix="kuzure-prediction-") as work:
            text = scene if "\n" in scene else open(f"{ROOT}/{scene}").read()
            sets = []
            for s in settings:
                if s == "!time.step":
                    text = "\n".join(line for line in text.splitlines() if not line.startswith("step ")) + "\n"
                else:
                    sets += ["--set", s]
            open(work + "/scene.toml", "w").write(text)
            r = subprocess.run(
                [a.program, "run", work + "/scene.toml", "-o", work + "/out", "--quiet", "--threads", a.threads, *sets],
                capture_output=True,
                text=True,
            )
            if r.returncode:
                sys.exit(f"{name}: exit {r.returncode}: {r.stderr}")
            s = json.load(open(work + "/out/summary.json"))
        p, (low, high), took = s["predicted_seconds"], s["predicted_interval"], s["wall_seconds"]
        off.append(p / took - 1)
        print(f"{name:34}{p:12.1f}{f'{low:.1f} .. {high:.1f}':>18}{took:10.1f}{100 * off[-1]:+7.0f}%", flush=True)
    median = statistics.median(map(abs, off))
    print(f"median of |predicted/actual - 1|: {100 * median:.0f} %")
    return 0 if median <= 0.2 else 1


if __name__ == "__main__":
    sys.exit(main())
