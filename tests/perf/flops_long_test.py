#!/usr/bin/python3
"""The operations that the pair loop declares (PairModel::flops_per_pair) against those that the processor executes.

    flops_long_test.py PROGRAM

A small collapse runs under valgrind's callgrind, which counts how often every instruction was executed; objdump says what each
of them is. In the pair loop's function an instruction belongs to
  the pairs   if it runs about once an entry inside the support (the square roots tell how many there are; loops may be unrolled
              by two),
  the update  if it runs at most once a cluster (its own square roots tell how many there are),
  the search  through the list with its skin else (a loop unrolled many times).
Lane-wise operations of the pairs, divided by entries and lanes, are what one pair costs: the declared number must be within
10 % (docs/performance.md). One pass a step, as the leap-frog has; the staggered scheme's two are not told apart here.
Skipped (exit 0, said so) without valgrind or on instruction sets it cannot run."""
import collections
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import block, program

SCENE = block(
    floor=None,
    title="operations of a pair",
    end=1.0e-3,
    effects="viscosity = { alpha = 0.1, beta = 0.0 }",
    accuracy='kernel = "cubic spline"\nscheme = "leap-frog"',
)
# one operation a lane; a fused multiply-add is two
ONE = re.compile(r"^v?(add|sub|mul|div|sqrt|max|min)(pd|sd)$")
TWO = re.compile(r"^vf(n?)m(add|sub|addsub|subadd)\d*(pd|sd)$")
INSTRUCTION = re.compile(r"^\s*([0-9a-f]+):\s+(\S+)\s*(.*)$")


def lanes(name, operands):
    return 1 if name.endswith("sd") else 8 if "%zmm" in operands else 4 if "%ymm" in operands else 2


def executed(path):
    """address -> times executed, of the pair loop's threads' function."""
    counts, inside = collections.Counter(), False
    skip = False
    for line in open(path, errors="replace"):
        if line.startswith("fn="):
            inside = "kuzure::ClusterPass<" in line and "::over<" in line and "_omp_fn" in line
        elif line.startswith("calls="):
            skip = True  # the next line is what the called function cost
        elif inside and line.startswith("0x"):
            if not skip:
                words = line.split()
                counts[int(words[0], 16)] += int(words[-1])
            skip = False
    return counts


def main():
    if not shutil.which("valgrind") or not shutil.which("objdump"):
        print("skipped: needs valgrind and objdump (jobs/install.sh tests)")
        return 0
    with tempfile.TemporaryDirectory(prefix="kuzure-flops-") as work:
        with open(work + "/s.toml", "w") as f:
            f.write(SCENE)
        out = subprocess.run(
            [
                "valgrind",
                "--tool=callgrind",
                "--dump-instr=yes",
                "--compress-pos=no",
                "--compress-strings=no",
                "--callgrind-out-file=" + work + "/cg",
                program,
                "run",
                work + "/s.toml",
                "-o",
                work + "/out",
                "--quiet",
                "--threads",
                "1",
            ],
            capture_output=True,
            text=True,
            cwd=work,
        )
        if out.returncode != 0:
            if "unhandled instruction" in out.stderr or "SIGILL" in out.stderr:
                print("skipped: this valgrind does not know the instructions of this build")
                return 0
            print(out.stderr)
            return 1
        timers = json.load(open(work + "/out/timers.json"))
        counts = executed(work + "/cg")
    if not counts:
        print("FAILED: callgrind saw no pair loop")
        return 1
    text = subprocess.run(["objdump", "-d", "--no-show-raw-insn", program], capture_output=True, text=True, check=True).stdout
    code = {}
    for line in text.splitlines():
        if m := INSTRUCTION.match(line):
            code[int(m[1], 16)] = (m[2], m[3])
    if not all(a in code for a in counts):
        print("FAILED: the addresses that callgrind names are not in the program")
        return 1
    roots = [n for a, n in counts.items() if re.match(r"^v?sqrtpd$", code[a][0])]
    if not roots:
        print("skipped: this instruction set takes no packed square root (estimates with Newton steps instead)")
        return 0
    busiest = max(roots)
    entries = sum(n for n in roots if n > 0.3 * busiest)
    clusters = max(n for n in roots if n <= 0.3 * busiest)
    groups = {"search": [0, 0], "pairs": [0, 0], "update": [0, 0]}  # instructions, operations
    width = 1
    for a, n in counts.items():
        name, operands = code[a]
        group = "pairs" if 0.3 * busiest < n <= entries else "update" if n <= clusters else "search"
        flops = 1 if ONE.match(name) else 2 if TWO.match(name) else 0
        if flops and group == "pairs":
            width = max(width, lanes(name, operands))
        groups[group][0] += n
        groups[group][1] += n * flops * lanes(name, operands)
    pairs, particles = timers["pairs"], timers["particle_steps"]
    loop = timers["phases"]["interior pairs"]
    declared = (loop["gflop_per_second"] * 1e9 * loop["seconds"]["max"] - 494 * particles) / pairs
    reached = groups["pairs"][1] / (entries * width)
    # What the program steps to predict its own time is of the same kind and was counted too: pairs in proportion to clusters.
    all_pairs = pairs * clusters * width / particles
    print(f"{entries} entries of {width} lanes, {all_pairs / entries:.2f} useful pairs an entry")
    for name, (instructions, _) in groups.items():
        print(f"  {name:7} {instructions / all_pairs:7.2f} instructions a pair")
    print(f"  update  {groups['update'][1] / clusters / width:7.1f} operations a particle by the processor, 494 declared")
    print(f"  pairs   {reached:7.1f} operations a pair by the processor, {declared:.1f} declared: {100 * (declared / reached - 1):+.1f} %")
    good = abs(declared / reached - 1) < 0.10
    print("ok" if good else "FAILED: the declaration is off by more than 10 %")
    return 0 if good else 1


if __name__ == "__main__":
    sys.exit(main())
