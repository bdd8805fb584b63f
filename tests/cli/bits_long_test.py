#!/usr/bin/python3
"""The whole hirata_52 (10,000 steps) on 7 ranks, re-partitioned all the way, has the bits and the history of one rank.
Half an hour on two cores. --steps N for less."""
import json, os, shutil, subprocess, sys, tempfile

program = os.path.abspath(sys.argv[1])
steps = int(sys.argv[3]) if sys.argv[2:3] == ["--steps"] else 10000
scene = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "jobs", "scenes", "hirata_52.toml")
work = tempfile.mkdtemp(prefix="kuzure-bits-long-")
failures = 0


def run(out, ranks, threads, *extra):
    command = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    command += [program, "run", scene, "-o", os.path.join(work, out), "--threads", str(threads), "--quiet", "--set", "output.every=0.5",
                "--set", f"time.end={steps * 1e-4:.8g}", *extra]
    subprocess.run(command, check=True, timeout=6000)
    with open(os.path.join(work, out, "summary.json")) as f, open(os.path.join(work, out, "history.csv"), "rb") as h:
        return json.load(f), h.read()


def check(good, what):
    global failures
    print(("ok    " if good else "FAIL  ") + what, flush=True)
    failures += not good


try:
    one, history_of_one = run("one", 1, 2)
    seven, history_of_seven = run("seven", 7, 1, "--recut-every", "20")
    check(one["steps"] == seven["steps"] == steps, f"{seven['steps']} steps, {seven['rebuilds']} rebuilds")
    check(seven["repartitions"] > one["rebuilds"] // 25, f"7 ranks re-partitioned {seven['repartitions']} times")
    check(one["state_hash"] == seven["state_hash"], f"equal bits: {one['state_hash']} and {seven['state_hash']}")
    check(history_of_one == history_of_seven, "equal history.csv")
    check(one["pairs"] == seven["pairs"], f"equal pairs: {one['pairs']}")
finally:
    shutil.rmtree(work, ignore_errors=True)
sys.exit(1 if failures else 0)
