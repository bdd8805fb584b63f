"""Instructions per directed pair of the bare pass, counted by callgrind on an x86-64-v3 build, against the stored count.

Time on a shared machine says little about a change; this count is exact. It may differ by 3 % from tests/perf/instructions.json,
which has one entry per compiler version. A stored count changes only in a commit of its own that says why:
    /usr/bin/python3 tests/perf/instructions_test.py build/release/kuzure --update
"""
import json
import pathlib
import re
import shutil
import subprocess
import sys

TOLERANCE = 0.03
NOT_RUN = 77
here = pathlib.Path(__file__).parent
stored = here / "instructions.json"
build = pathlib.Path(sys.argv[1]).resolve().parent
program = build / "tests" / "instructions"


def not_run(why):
    print(f"NOT RUN: {why}")
    sys.exit(NOT_RUN)


def compiler():
    cache = (build / "CMakeCache.txt").read_text()
    path = re.search(r"^CMAKE_CXX_COMPILER:\w+=(.*)$", cache, re.M).group(1)
    first = subprocess.run([path, "--version"], capture_output=True, text=True, check=True).stdout.splitlines()[0]
    return re.sub(r"^\S+ ", "", first)


def counted(passes, how):
    """Instructions of the whole program, and the pairs of a pass."""
    out = subprocess.run(
        ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", str(program), str(passes), how],
        capture_output=True,
        text=True,
        timeout=600,
        env={"OMP_NUM_THREADS": "1", "PATH": "/usr/bin:/bin"},
    )
    if out.returncode != 0:
        sys.exit(f"valgrind or {program} failed ({out.returncode}):\n{out.stderr[-2000:]}")
    total = re.search(r"Collected : (\d+)", out.stderr)
    return int(total.group(1)), int(out.stdout)


def main():
    if shutil.which("valgrind") is None:
        not_run("valgrind is not installed: jobs/install.sh tests")
    if "avx2" not in pathlib.Path("/proc/cpuinfo").read_text():
        not_run("this processor has no AVX2")
    if not program.exists():
        not_run(f"{program} was not built (benchmarks off, or not an optimised build)")

    name = compiler()
    found = {}
    for how in ("lanes", "plain", "staggered"):
        few, pairs = counted(5, how)
        many, _ = counted(10, how)
        found[how] = round((many - few) / 5 / pairs, 2)
    print(f"{name}: {found} instructions per directed pair")

    known = json.loads(stored.read_text())
    if "--update" in sys.argv:
        known[name] = found
        stored.write_text(json.dumps(known, indent=2) + "\n")
        print(f"stored in {stored}")
        sys.exit(0)
    if name not in known:
        not_run(f"no count is stored for {name}; those of {', '.join(known) or 'no compiler'} are")
    wrong = []
    for how, count in found.items():
        ratio = count / known[name][how]
        print(f"{how}: {count}, stored {known[name][how]}, ratio {ratio:.4f}")
        if abs(ratio - 1) > TOLERANCE:
            wrong.append(f"{how}: {ratio:.3f} of the stored count")
    sys.exit("; ".join(wrong) or 0)


if __name__ == "__main__":
    main()
