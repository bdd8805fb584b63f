#!/usr/bin/python3
"""Bytes a soil particle takes, all of it: counted in arrays, beside what kuzure check says and what the system gave. Counts, no times."""
import json
import os
import re
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, program, root, scratch

work = scratch("memory")

# A scene, what of it is changed, and the most bytes a particle: of clusters of four (AVX2), whose lists are twice as long as those of eight.
CASES = (
    ("the paper's cube by the defaults", "hirata_52_default", ["time.end=0.02"], 600),
    ("a coarser one that has spread", "hirata_52_default", ["space.spacing=0.08", "time.end=1.0"], 700),
    ("in mixed precision", "hirata_52_default", ["time.end=0.02", 'accuracy.precision="mixed"'], 520),
    ("by the leap-frog", "hirata_52", ["time.end=0.002"], 800),
    ("the first example", "quickstart", ["time.end=0.02"], 700),
)


def peak(arguments):
    """The largest resident size of a program, in bytes."""
    pid = os.fork()
    if pid == 0:
        with open(os.devnull, "w") as nothing:
            os.dup2(nothing.fileno(), 1)
        os.execv(arguments[0], arguments)
    _, status, usage = os.wait4(pid, 0)
    return os.waitstatus_to_exitcode(status), 1024 * usage.ru_maxrss


def estimated(scene, sets):
    done = subprocess.run([program, "check", scene, "--json", *sets], capture_output=True, text=True)
    return json.loads(done.stdout)["memory_bytes"]


def main():
    for name, scene, changes, most in CASES:
        path = f"{work}/{scene}.toml"
        with open(f"{root}/jobs/scenes/{scene}.toml") as f:  # without pictures, which are made when the run is over
            text = "".join(line for line in f if not line.startswith("picture"))
        with open(path, "w") as f:
            f.write(text)
        sets = [word for change in changes for word in ("--set", change)]
        out = f"{work}/{scene}"
        code, resident = peak([program, "run", path, *sets, "-o", out, "--force", "--threads", "2", "--quiet"])
        if not check(code == 0, f"{name}: exit {code}"):
            continue
        told = json.load(open(out + "/summary.json"))
        soil, kinds = told["soil_particles"], told["memory_bytes_by_kind"]
        each = {kind: round(bytes_ / soil) for kind, bytes_ in kinds.items()}
        check(sum(kinds.values()) == told["memory_bytes_per_rank"], f"{name}: kinds make up the whole: {each}")
        here = told["memory_bytes_per_rank"] / soil
        check(here <= most, f"{name}: {here:.0f} bytes a particle in arrays, at most {most}")
        guess = estimated(path, sets)
        check(0.6 * resident <= guess <= 1.6 * resident, f"{name}: check says {guess / 1e6:.0f} MB, resident were {resident / 1e6:.0f} MB")
    finish()


if __name__ == "__main__":
    main()
