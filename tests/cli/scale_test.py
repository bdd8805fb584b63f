#!/usr/bin/python3
"""kuzure scale against kuzure run: what is counted for a number of ranks is what that many ranks then do, to the particle."""
import json
import os
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, program, scratch

work = scratch("scale")


def call(*command, expect=0):
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    check(done.returncode == expect, f"{' '.join(command[-4:])}: exit {done.returncode}, expected {expect} {done.stderr.strip()[-300:]}")
    return done


def scale(scene, ranks, *extra):
    done = call(program, "scale", scene, "--ranks", ",".join(map(str, ranks)), "--json", "--per-rank", *extra)
    return {case["ranks"]: case for case in json.loads(done.stdout)}


def run(scene, ranks, out, *extra):
    out = os.path.join(work, out)
    call("mpirun", "-n", str(ranks), program, "run", scene, "-o", out, "--threads", "1", "--quiet", "--force", *extra)
    with open(os.path.join(out, "timers.json")) as f:
        return json.load(f)


def counted(case):
    return [
        {
            "soil": r["soil"],
            "pairs": r["soil_pairs"] + r["wall_pairs"],
            "ghosts": r["ghosts"],
            "halo_bytes": r["halo_bytes"],
            "messages": r["messages"],
        }
        for r in case["per_rank"]
    ]


SAND = """[soil.sand]
density = 1850.0
young = 1.8e6
poisson = 0.3
cohesion = {cohesion}
friction_angle = 25.0
[effects]
gravity = [0.0, 0.0, -9.81]
viscosity = {{ alpha = 0.1, beta = 0.0 }}
artificial_stress = "auto"
[accuracy]
scheme = "leap-frog"
precision = "{precision}"
"""
CUBE = """title = "a cube on a floor, and a wall beside it"
dimensions = 3
[space]
spacing = 0.04
h = 1.2
[time]
end = 1.0e-4
step = 1.0e-4
[[body]]
soil = "sand"
box = { low = [3.28, 3.28, 0.0], high = [4.08, 4.08, 0.8] }
[[wall]]
box = { low = [2.0, 2.0, -0.16], high = [5.0, 5.0, 0.0] }
[[wall]]
box = { low = [3.12, 3.0, 0.0], high = [3.28, 4.2, 0.4] }
"""
ROUND = """title = "a cylinder and a box, periodic across"
dimensions = 3
[space]
spacing = 0.04
h = 1.2
low = [-2.0, -0.52, -1.0]
high = [3.0, 0.52, 2.0]
periodic = ["y"]
[time]
end = 1.0e-4
step = 1.0e-4
[[body]]
soil = "sand"
box = { low = [0.0, -0.52, 0.0], high = [0.48, 0.52, 0.48] }
[[body]]
soil = "sand"
cylinder = { base = [1.2, 0.1, 0.0], radius = 0.31, height = 0.6 }
[[wall]]
box = { low = [-0.8, -0.52, -0.16], high = [1.6, 0.52, 0.0] }
"""
FLAT = """title = "a plane column"
dimensions = 2
[space]
spacing = 0.01
h = 1.2
[time]
end = 1.0e-5
step = 1.0e-5
[[body]]
soil = "sand"
box = { low = [0.0, 0.0, 0.0], high = [0.8, 0.0, 0.5] }
[[wall]]
box = { low = [-0.5, 0.0, -0.04], high = [1.5, 0.0, 0.0] }
"""


def main():
    scenes = {
        "cube": (CUBE, dict(cohesion=0.0, precision="double"), (2, 4, 7)),
        "round": (ROUND, dict(cohesion=3000.0, precision="double"), (2, 7)),
        "flat": (FLAT, dict(cohesion=0.0, precision="mixed"), (4,)),
    }
    files = {}
    for name, (text, numbers, ranks) in scenes.items():
        files[name] = os.path.join(work, name + ".toml")
        with open(files[name], "w") as f:
            f.write(text + SAND.format(**numbers))
        cases = scale(files[name], ranks)
        for n in ranks:
            did = run(files[name], n, f"{name}-{n}")
            check(did["first_step"] == counted(cases[n]), f"{name} on {n} ranks does what was counted: {did['first_step']}")
            check(
                did["halo_bytes"] == cases[n]["halo_bytes_per_step"] and did["messages"] == cases[n]["messages_per_step"],
                f"{name} on {n} ranks sends what was counted: {did['halo_bytes']} bytes, {did['messages']} messages",
            )
            if min(r["soil"] for r in did["first_step"]) >= 2000:
                check(cases[n]["pair_balance"] <= 1.05, f"{name} on {n} ranks: pairs {cases[n]['pair_balance']:.3f} of the mean at most")
    # The control: other lists reach further and see more ghosts.
    other = scale(files["cube"], [4], "--set", "accuracy.skin=0.5")[4]
    check(counted(other) != counted(scale(files["cube"], [4])[4]), "a longer reach is counted differently")

    # Many ranks, without running them: particles are shared out whole, and doubling latency never helps.
    many = scale(files["cube"], [1, 64], "--machine", "oakforest-pacs")
    check(sum(r["soil"] for r in many[64]["per_rank"]) == 8000, "64 ranks hold the scene's soil")
    check(many[1]["predicted_efficiency"] == 1 and many[64]["predicted_efficiency"] < 1, "efficiency counts from the smallest")
    slow = many[64]["predicted_seconds_per_step_if"]
    check(slow["latency_doubled"] > many[64]["predicted_seconds_per_step"] <= slow["bandwidth_halved"], "worse networks take longer")
    check(
        abs(sum(many[64]["predicted_step"].values()) / many[64]["predicted_seconds_per_step"] - 1) < 1e-9, "parts of the step add up to it"
    )

    # A later state: 400 steps on 3 ranks, then counted and run for 4. The run's ghosts are those of the last sort, from which
    # particles have moved on since: nearly as many, not exactly.
    later = ("--set", "time.end=0.04", "--set", "body.0.velocity=[1.0, 0.0, 0.0]")
    run(files["cube"], 3, "later", *later)
    state = os.path.join(work, "later")
    case = scale(files["cube"], [4], *later, "--from", state)[4]
    check(case["pair_balance"] <= 1.05, f"the later state is shared evenly: {case['pair_balance']:.3f}")
    call(
        "mpirun",
        "-n",
        "4",
        program,
        "run",
        files["cube"],
        "-o",
        state,
        "--threads",
        "1",
        "--quiet",
        "--restart",
        *later,
        "--set",
        "time.end=0.0401",
    )
    with open(os.path.join(state, "timers.json")) as f:
        did = json.load(f)["first_step"]
    for key in ("soil", "pairs", "ghosts"):
        a, b = sum(r[key] for r in did), sum(r[key] for r in counted(case))
        check(abs(a - b) <= (0.08 if key == "ghosts" else 0) * b, f"after a restart on 4 ranks: {a} {key}, counted {b}")
    check(max(r["pairs"] for r in did) * 4 <= 1.06 * sum(r["pairs"] for r in did), "a restart shares pairs evenly")

    # What cannot be
    for what, command, words in (
        ("no ranks", [files["cube"]], "--ranks"),
        ("too many", [files["cube"], "--ranks", "40000", "--machine", "oakforest-pacs"], "8208 nodes"),
        ("unknown machine", [files["cube"], "--ranks", "2", "--machine", "nowhere"], "nowhere"),
        ("another scene's state", [files["flat"], "--ranks", "2", "--from", state], "another scene"),
        ("no state", [files["flat"], "--ranks", "2", "--from", work], "checkpoint"),
    ):
        done = call(program, "scale", *command, expect=2)
        check(words in done.stderr, f"{what}: the message says so: {done.stderr.strip()[:200]}")
    finish()


if __name__ == "__main__":
    main()
