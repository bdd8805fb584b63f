#!/usr/bin/python3
"""The law of equal bits, through the program: any ranks x threads, any restart, the same state_hash and history.csv."""
import json, os, shutil, subprocess, sys, tempfile

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, program

here = os.path.dirname(os.path.abspath(__file__))
work = tempfile.mkdtemp(prefix="kuzure-bits-")


def run(scene, out, ranks=1, threads=1, extra=(), expect=0):
    command = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    command += [program, "run", scene, "-o", os.path.join(work, out), "--threads", str(threads), "--quiet", *extra]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    check(done.returncode == expect, f"{out}: exit {done.returncode}, expected {expect} {done.stderr.strip()[-300:]}")
    with open(os.path.join(work, out, "summary.json")) as f:
        return json.load(f)


def history(out):
    with open(os.path.join(work, out, "history.csv"), "rb") as f:
        return f.read()


FAST = """title = "a block thrown across the floor"
dimensions = 3
[space]
spacing = 0.04
h = 1.2
low = [-2.0, -0.24, -1.0]
high = [3.0, 0.24, 2.0]
periodic = ["y"]
[time]
end = 0.02
step = 1.0e-4
[soil.sand]
density = 1850.0
young = 1.8e6
poisson = 0.3
cohesion = {cohesion}
friction_angle = 25.0
[[body]]
soil = "sand"
box = {{ low = [0.0, -0.24, 0.0], high = [0.48, 0.24, 0.48] }}
velocity = [5.0, 1.5, 0.5]
[[wall]]
box = {{ low = [-0.8, -0.24, -0.16], high = [1.6, 0.24, 0.0] }}
[effects]
gravity = [0.0, 0.0, -9.81]
viscosity = {{ alpha = 0.1, beta = {beta} }}
artificial_stress = "auto"
[accuracy]
precision = "{precision}"
skin = 0.05
[output]
history = 0.001
every = 0.01
"""
EVERY_EFFECT = {
    "friction_angle = 25.0": """dilation_angle = 5.0
dilation_decay = 0.05
tension_cutoff = 2000.0
softening = { cohesion = 1000.0, friction_angle = 20.0, slip = 0.01 }
rate_friction = { friction_angle = 33.0, grain = 0.001 }""",
    "high = [1.6, 0.24, 0.0] }": "surface = { friction_angle = 20.0 }",
    "[effects]": """stress_diffusion = { zeta = 0.1 }
pore_pressure = { table = [[0.0, 0.3], [1.0, 0.1]] }
damping = { ratio = 0.02, until = 0.005 }""",
    "[accuracy]": 'correction = "gradient"',
}
try:
    for name, numbers in {
        "dry, double": dict(cohesion=0.0, beta=0.0, precision="double"),
        "cohesive, double": dict(cohesion=3000.0, beta=0.5, precision="double"),
        "dry, mixed": dict(cohesion=0.0, beta=0.0, precision="mixed"),
        "every effect, double": dict(cohesion=3000.0, beta=0.5, precision="double"),
        "every effect, mixed": dict(cohesion=3000.0, beta=0.5, precision="mixed"),
        "every effect, mixed, asleep": dict(cohesion=3000.0, beta=0.5, precision="mixed"),
    }.items():
        tag = name.replace(", ", "-").replace(" ", "-")
        scene = os.path.join(work, tag + ".toml")
        with open(scene, "w") as f:
            text = FAST.format(**numbers)
            if name.startswith("every"):
                for key, more in EVERY_EFFECT.items():
                    assert key in text
                    text = text.replace(key, key + "\n" + more)
            if name.endswith("asleep"):
                text = text.replace("skin = 0.05", "skin = 0.05\nsleep_below = 5.15")
            f.write(text)
        one = run(scene, tag + "-1x1")
        check(one["rebuilds"] > 5, f"{name}: {one['rebuilds']} rebuilds")
        with open(os.path.join(work, tag + "-1x1", "timers.json")) as f:
            timers = json.load(f)
        asleep = timers["particle_steps_asleep"] / timers["particle_steps"]
        check(0.1 < asleep < 0.9 if name.endswith("asleep") else asleep == 0, f"{name}: {asleep:.2f} of the soil's steps are slept through")
        for ranks, threads in ((1, 2), (2, 1), (4, 1), (7, 1)):
            out = f"{tag}-{ranks}x{threads}"
            other = run(scene, out, ranks, threads, ["--recut-every", "3"])
            check(other["state_hash"] == one["state_hash"], f"{name}: {ranks} x {threads} has the bits of 1 x 1")
            check(history(out) == history(tag + "-1x1"), f"{name}: {ranks} x {threads} has its history")
            check(other["pairs"] == one["pairs"], f"{name}: {ranks} x {threads} counts its pairs")
            if ranks > 1:
                check(other["repartitions"] > 0, f"{name}: {ranks} ranks re-partitioned {other['repartitions']} times")
        # a restart in between, on other ranks
        out = tag + "-restarted"
        run(scene, out, 3, 1, ["--set", "time.end=0.0083"])
        again = run(scene, out, 2, 1, ["--restart", "--recut-every", "2"])
        check(again["state_hash"] == one["state_hash"], f"{name}: 3 ranks, restarted on 2, has the bits of 1 x 1")
        rows = [r for r in history(out).decode().splitlines()[2:]]
        times = [float(r.split(",")[0]) for r in rows]
        check(times == sorted(set(times)), f"{name}: no row of history.csv is doubled by the restart")
        wanted = set(history(tag + "-1x1").decode().splitlines()[2:])
        check(wanted <= set(rows), f"{name}: no row of history.csv is missing or changed after the restart")
    # the negative control: another step length must change the hash
    changed = run(scene, "control", extra=["--set", "time.step=9.9e-5"])
    check(changed["state_hash"] != one["state_hash"], "another step gives other bits")
finally:
    shutil.rmtree(work, ignore_errors=True)
finish()
