#!/usr/bin/python3
"""The whole hirata_52 (10,000 steps) on 7 ranks, re-partitioned all the way, has the bits and the history of one rank.
Half an hour on two cores. --steps N for less."""
import json
import os
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, program, root, scratch

steps = int(sys.argv[3]) if sys.argv[2:3] == ["--steps"] else 10000
scene = os.path.join(root, "jobs/scenes/hirata_52.toml")
work = scratch("bits-long")


def run(out, ranks, threads, *extra):
    command = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    command += [
        program,
        "run",
        scene,
        "-o",
        os.path.join(work, out),
        "--threads",
        str(threads),
        "--quiet",
        "--set",
        "output.every=0.5",
        "--set",
        f"time.end={steps * 1e-4:.8g}",
        *extra,
    ]
    subprocess.run(command, check=True, timeout=6000)
    with open(os.path.join(work, out, "summary.json")) as f, open(os.path.join(work, out, "history.csv"), "rb") as h:
        return json.load(f), h.read()


def main():
    one, history_of_one = run("one", 1, 2)
    seven, history_of_seven = run("seven", 7, 1, "--recut-every", "20")
    check(one["steps"] == seven["steps"] == steps, f"{seven['steps']} steps, {seven['rebuilds']} rebuilds")
    check(seven["repartitions"] > one["rebuilds"] // 25, f"7 ranks re-partitioned {seven['repartitions']} times")
    check(one["state_hash"] == seven["state_hash"], f"equal bits: {one['state_hash']} and {seven['state_hash']}")
    check(history_of_one == history_of_seven, "equal history.csv")
    check(one["pairs"] == seven["pairs"], f"equal pairs: {one['pairs']}")
    finish()


if __name__ == "__main__":
    main()
