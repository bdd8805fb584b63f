#!/usr/bin/python3
"""jobs/scaling.py on a tiny scaling: tables, plots, a split of the losses that adds up, resuming, and points as batch jobs."""
import csv
import glob
import json
import os
import re
import shutil
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import block, check, finish, program, root, scratch

work = scratch("scaling")
env = dict(
    os.environ,
    PATH=os.path.join(root, "tests/cluster") + ":" + os.environ["PATH"],
    OMPI_MCA_rmaps_base_oversubscribe="1",
    KUZURE_CORES="2",
    OMPI_ALLOW_RUN_AS_ROOT="1",
    OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
    OMPI_MCA_hwloc_base_binding_policy="none",
    OMPI_MCA_mpi_yield_when_idle="1",
)


def scaling(*args, expect=0, says=""):
    done = subprocess.run(
        ["/usr/bin/python3", os.path.join(root, "jobs/scaling.py"), *args, "--kuzure", program],
        capture_output=True,
        text=True,
        timeout=300,
        cwd=work,
        env=env,
    )
    good = done.returncode == expect and says in done.stdout + done.stderr
    check(good, f"scaling.py {' '.join(args)}: exit {done.returncode}, expected {expect} {'' if good else done.stderr[-600:]}")
    return done.stdout


def write(name, text):
    with open(os.path.join(work, name), "w") as f:
        f.write(text)


def rows(directory):
    with open(os.path.join(work, directory, "points.csv")) as f:
        return list(csv.DictReader(f))


BLOCK = block(effects="viscosity = { alpha = 0.1 }")
STRONG = """title = "tiny"
kind = "strong"
repeats = 2
[here]
layouts = [[1, 1], [2, 1], [3, 1]]
[machine]
nodes = [1, 2]
[quick]
repeats = 1
set = ["time.end=0.001"]
[[case]]
scene = "block.toml"
"""


def main():
    write("block.toml", BLOCK)
    write("strong.toml", STRONG)
    said = scaling("strong.toml", "-o", "out")
    check("needs 3 cores" in said, "what does not fit the cores is named, not run")
    table = rows("out")
    check(
        [r["point"] for r in table] == ["block-1x1", "block-2x1"] and all(r["runs"] == "2" for r in table),
        "a row a point, two repeats each",
    )
    groups = [k[5:] for k in table[0] if k.startswith("lost ")]
    check(groups == ["kernel", "lists", "imbalance", "halo", "migration", "re-cut", "reductions", "I/O"], f"losses are split: {groups}")
    last = table[1]
    lost = sum(float(last["lost " + g]) for g in groups)
    check(
        abs(lost - (1 - float(last["efficiency"]))) < 1e-9 and float(table[0]["efficiency"]) == 1, f"and add up to 1 - efficiency: {lost}"
    )
    check(
        abs(sum(float(last["ns " + g]) for g in groups) - float(last["core_ns"])) < 1e-6 * float(last["core_ns"]),
        "as the costs add up to the whole",
    )
    # Against the timers themselves: everything but setup, on the mean rank.
    with open(os.path.join(work, "out/block-2x1/run_0/timers.json")) as f:
        timers = json.load(f)
    with open(os.path.join(work, "out/block-2x1/run_1/timers.json")) as f:
        timers = [timers, json.load(f)]
    whole = [2e9 * (t["total"]["seconds"]["mean"] - t["phases"]["setup"]["seconds"]["mean"]) / (512 * 40) for t in timers]
    check(any(abs(float(last["core_ns"]) - w) < 0.01 * w for w in whole), f"core-ns {last['core_ns']} is that of timers.json: {whole}")
    with open(os.path.join(work, "out/report.md")) as f:
        text = f.read()
    worst = max(groups, key=lambda g: float(last["lost " + g]))
    check(f"**{worst}**" in text and "same state_hash" in text, f"the report names the largest loss, {worst}")
    for name in ("efficiency", "losses"):
        check(
            open(os.path.join(work, f"out/{name}.png"), "rb").read(4) == b"\x89PNG"
            and "<svg" in open(os.path.join(work, f"out/{name}.svg")).read(),
            f"{name} is drawn",
        )

    # Again: nothing runs. A repeat that is missing runs, and it alone.
    stamps = lambda: {f: os.stat(f).st_mtime_ns for f in glob.glob(os.path.join(work, "out/*/run_*/summary.json"))}
    before = stamps()
    os.remove(os.path.join(work, "out/block-2x1/run_1/summary.json"))
    scaling("strong.toml", "-o", "out")
    after = stamps()
    check(
        len(before) == 4 and [f for f in before if before[f] != after.get(f)] == [os.path.join(work, "out/block-2x1/run_1/summary.json")],
        "only what is missing runs again",
    )
    write("strong.toml", STRONG.replace('set = ["time', 'set = ["output.history=0.001", "time'))
    scaling("strong.toml", "-o", "out", "--quick")
    check(
        all(int(r["steps"]) == 10 and r["runs"] == "1" for r in rows("out")),
        "--quick takes the smaller settings, and old points are run anew",
    )

    # Output as a long run has it: two snapshots in 10 steps are charged as one in 1,000.
    write("rare.toml", STRONG.replace("repeats = 2", "repeats = 2\nsteps_per_output = 1000", 1))
    often = rows("out")[0]
    shutil.copytree(os.path.join(work, "out"), os.path.join(work, "rare"))
    scaling("rare.toml", "-o", "rare", "--quick")
    with open(os.path.join(work, "rare/block-1x1/run_0/timers.json")) as f:
        once = json.load(f)["phases"]
    rare = (
        1e9
        / 5120
        * (
            once["history"]["seconds"]["mean"]
            + sum(once[p]["seconds"]["mean"] / once[p]["calls"] for p in ("snapshot", "checkpoint")) / 100
        )
    )
    check(
        abs(float(rows("rare")[0]["ns I/O"]) - rare) < 0.01 * rare < 0.1 * float(often["ns I/O"]),
        "steps_per_output charges output as a long run has it",
    )

    # Tiles: twice the soil on twice the cores.
    write(
        "weak.toml",
        'title = "w"\nkind = "weak"\nset = ["time.end=0.001"]\n[[case]]\nseries = "t"\nscene = "block.toml"\nshare = 1\n'
        '[[case]]\nseries = "t"\nscene = "block.toml"\nshare = 2\ntiles = [2, 1]\n',
    )
    scaling("weak.toml", "-o", "weak")
    check([(r["soil"], r["cores"]) for r in rows("weak")] == [("512", "1"), ("1024", "2")], "tiles repeat the soil sideways")

    # As batch jobs, through the stand-in of pjsub: first nothing, then submitted, then collected.
    with open(os.path.join(root, "jobs/machines/oakforest-pacs.toml")) as f:
        profile = re.sub(r"^ranks = \d+", "ranks = 1", re.sub(r"^cores = \d+", "cores = 1", f.read(), flags=re.M), flags=re.M)
    write("ofp.toml", profile)
    machine = ["strong.toml", "-o", "jobs", "--quick", "--machine", "./ofp.toml", "--account", "gz00"]
    said = scaling(*machine, says="no point")
    check(said.count("pjsub /") == 2, "without --submit it says what to submit")
    said = scaling(*machine, "--submit")
    check(said.count("submitted") == 2, "jobs are submitted")
    check([(r["nodes"], r["ranks"]) for r in rows("jobs")] == [("1", "1"), ("2", "2")], "and their points collected")
    check("submitted" not in scaling(*machine, "--submit"), "once")

    # What is wrong.
    for old, new, says in [
        ("repeats = 2", "repeat = 2", 'strong.toml:3: repeat: expected a known key, found "repeat"; did you mean "repeats"'),
        ('"strong"', '"stong"', "kind: expected"),
        ("block.toml", "blok.toml", "found no file"),
        ("layouts = [[1, 1], [2, 1]", "layouts = [[1, 1], [1, 1]", "two points"),
    ]:
        write("strong.toml", STRONG.replace(old, new))
        scaling("strong.toml", "-o", "bad", expect=2, says=says)
    write("strong.toml", STRONG.replace("time.end=0.001", "time.ned=0.001"))
    scaling("strong.toml", "-o", "bad", "--quick", expect=4, says="time.ned")
    finish()


if __name__ == "__main__":
    main()
