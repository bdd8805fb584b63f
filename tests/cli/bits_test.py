#!/usr/bin/python3
"""The law of equal bits, through the program: any ranks x threads, any restart, the same state_hash and history.csv."""
import json
import os
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import block, check, finish, program, scratch

here = os.path.dirname(os.path.abspath(__file__))
work = scratch("bits")


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


EVERYTHING = {  # lines of every effect, by section
    "soil": """dilation_angle = 5.0
dilation_decay = 0.05
tension_cutoff = 2000.0
softening = { cohesion = 1000.0, friction_angle = 20.0, slip = 0.01 }
rate_friction = { friction_angle = 33.0, grain = 0.001 }
""",
    "wall": "surface = { friction_angle = 20.0 }",
    "effects": """stress_diffusion = { zeta = 0.1 }
pore_pressure = { table = [[0.0, 0.3], [1.0, 0.1]] }
damping = { ratio = 0.02, until = 0.005 }
""",
    "accuracy": 'correction = "adjoint"\ncfl = 0.7\nshifting = 2.0\nhourglass = 0.1\n',
}


def scene(cohesion, beta, precision, everything=False, asleep=False):
    more = EVERYTHING if everything else dict.fromkeys(EVERYTHING, "")
    return block(
        (0.48, 0.24, 0.48),
        ((-0.8, -0.24, -0.16), (1.6, 0.24, 0)),
        low=(0, -0.24, 0),
        title="a block thrown across the floor",
        end=0.02,
        space='low = [-2.0, -0.24, -1.0]\nhigh = [3.0, 0.24, 2.0]\nperiodic = ["y"]',
        soil=more["soil"] + f"cohesion = {cohesion}",
        body="velocity = [5.0, 1.5, 0.5]",
        wall=more["wall"],
        effects=more["effects"] + f'viscosity = {{ alpha = 0.1, beta = {beta} }}\nartificial_stress = "auto"',
        accuracy=more["accuracy"] + f'precision = "{precision}"\nskin = 0.05' + ("\nsleep_below = 5.15" if asleep else ""),
        output="history = 0.001\nevery = 0.01",
    )


def main():
    for name, numbers in {
        "dry, double": dict(cohesion=0.0, beta=0.0, precision="double"),
        "cohesive, double": dict(cohesion=3000.0, beta=0.5, precision="double"),
        "dry, mixed": dict(cohesion=0.0, beta=0.0, precision="mixed"),
        "every effect, double": dict(cohesion=3000.0, beta=0.5, precision="double"),
        "every effect, mixed": dict(cohesion=3000.0, beta=0.5, precision="mixed"),
        "every effect, mixed, asleep": dict(cohesion=3000.0, beta=0.5, precision="mixed"),
    }.items():
        tag = name.replace(", ", "-").replace(" ", "-")
        path = os.path.join(work, tag + ".toml")
        with open(path, "w") as f:
            f.write(scene(**numbers, everything=name.startswith("every"), asleep=name.endswith("asleep")))
        one = run(path, tag + "-1x1")
        check(one["rebuilds"] > 5, f"{name}: {one['rebuilds']} rebuilds")
        with open(os.path.join(work, tag + "-1x1", "timers.json")) as f:
            timers = json.load(f)
        asleep = timers["particle_steps_asleep"] / timers["particle_steps"]
        check(0.1 < asleep < 0.9 if name.endswith("asleep") else asleep == 0, f"{name}: {asleep:.2f} of the soil's steps are slept through")
        for ranks, threads in ((1, 2), (2, 1), (4, 1), (7, 1)):
            out = f"{tag}-{ranks}x{threads}"
            other = run(path, out, ranks, threads, ["--recut-every", "3"])
            check(other["state_hash"] == one["state_hash"], f"{name}: {ranks} x {threads} has the bits of 1 x 1")
            check(history(out) == history(tag + "-1x1"), f"{name}: {ranks} x {threads} has its history")
            check(other["pairs"] == one["pairs"], f"{name}: {ranks} x {threads} counts its pairs")
            if ranks > 1:
                check(other["repartitions"] > 0, f"{name}: {ranks} ranks re-partitioned {other['repartitions']} times")
        # a restart in between, on other ranks
        out = tag + "-restarted"
        run(path, out, 3, 1, ["--set", "time.end=0.0083"])
        again = run(path, out, 2, 1, ["--restart", "--recut-every", "2"])
        check(again["state_hash"] == one["state_hash"], f"{name}: 3 ranks, restarted on 2, has the bits of 1 x 1")
        rows = [r for r in history(out).decode().splitlines()[2:]]
        times = [float(r.split(",")[0]) for r in rows]
        check(times == sorted(set(times)), f"{name}: no row of history.csv is doubled by the restart")
        wanted = set(history(tag + "-1x1").decode().splitlines()[2:])
        check(wanted <= set(rows), f"{name}: no row of history.csv is missing or changed after the restart")
    # the negative control: another step length must change the hash
    changed = run(path, "control", extra=["--set", "time.step=9.9e-5"])
    check(changed["state_hash"] != one["state_hash"], "another step gives other bits")
    finish()


if __name__ == "__main__":
    main()
