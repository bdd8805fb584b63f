#!/usr/bin/python3
"""kuzure safety: a small slope's factor of safety is bracketed, scales with its strength, is the mirrored slope's, of any --jobs and after
any kill; a stage of a scene with events; what lies outside the range; what is refused. Run as safety_test.py PROGRAM."""
import csv
import glob
import math
import os
import shutil
import signal
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, program, scratch
from runs import Runs

work = scratch("safety")
runs = Runs(work)
# Griffiths & Lane (1999), example 1, ten spacings high: factor of safety 1.38.
H, DX = 10.0, 1.0


def scene(
    name,
    cohesion=10e3,
    tangent=math.tan(math.radians(20)),
    mirrored=False,
    more="",
    gravity="gravity = [0.0, 0.0, -9.81]",
    body="",
    stress="at rest",
):
    x = (lambda v: -v) if mirrored else (lambda v: v)
    corners = [[x(0.0), 0.0], [x(30.0), 0.0], [x(10.0), H], [x(0.0), H]]
    floor, back = sorted([x(-4 * DX), x(50.0)]), sorted([x(-4 * DX), x(0.0)])
    phi = math.degrees(math.atan(tangent))
    with open(os.path.join(work, name + ".toml"), "w") as f:
        f.write(
            f"""title = "slope"
dimensions = 2
[space]
spacing = {DX}
[time]
end = 0.4
[soil.soil]
density = 2038.7
young = 2.5e7
poisson = 0.3
cohesion = {cohesion!r}
friction_angle = {phi!r}
dilation_angle = {phi!r}
cone = "plane strain"
[[body]]
soil = "soil"
polygon = {{ points = {corners} }}
stress = "{stress}"
{body}
[[wall]]
box = {{ low = [{floor[0]}, 0.0, {-4 * DX}], high = [{floor[1]}, 0.0, 0.0] }}
[[wall]]
box = {{ low = [{back[0]}, 0.0, 0.0], high = [{back[1]}, 0.0, {H + 2 * DX}] }}
surface = "smooth"
[effects]
{gravity}
viscosity = {{ alpha = 0.1 }}
artificial_stress = "auto"
{more}
"""
        )
    return name + ".toml"


def call(*args, **how):
    return runs.call("safety", *args, **how)


def answer(directory):
    return runs.json(directory, "safety.json")


def table(directory):
    return runs.read(directory, "safety.csv")


def rows(directory):
    """The looks at each trial, by its factor: numbers as written."""
    found = {}
    for line in table(directory).splitlines()[2:]:
        found.setdefault(line.split(",")[0], []).append(line)
    return found


# ---- an answer
slope = scene("slope")
WIDE = ("--from", "0.8", "--to", "2", "--bracket", "0.04")
call(slope, "-o", "one", "--jobs", "1", *WIDE)
one = answer("one")
check(
    one["stands"] < one["factor"] < one["fails"] and one["fails"] - one["stands"] < 0.0401, f"a bracket: {one['stands']} to {one['fails']}"
)
check(abs(one["factor"] - 1.38) < 0.05 * 1.38, f"the chart's 1.38 within 5 % at ten spacings: {one['factor']}")
outcomes = {t["factor"]: t["outcome"] for t in one["trials"]}
check(
    all(o == ("holds" if f <= one["stands"] else "fails") for f, o in outcomes.items()) and len(outcomes) == len(one["trials"]),
    f"every trial below holds, every one above fails: {outcomes}",
)
moved = [t["displacement"] for t in one["trials"] if t["outcome"] == "holds"]
check(moved == sorted(moved) and moved[-1] > moved[0], "weaker soil that holds has moved farther")
check(all(t["unbalanced"] >= 5e-4 for t in one["trials"] if t["outcome"] == "fails"), "what fails still moves")
with open(os.path.join(work, "one", "report.html")) as f:
    page = f.read()
check("data:image/png" in page and "Factor of safety" in page and "<svg" in page, "a page with its picture and its curve")
check(os.path.getsize(os.path.join(work, "one", "slip_surface.png")) > 1000, "a picture of the slip surface")
names = {t["run"] for t in one["trials"]}
check(all(os.path.exists(os.path.join(work, "one", n, "summary.json")) for n in names), "every trial is a run's directory")
subprocess.run([program, "report", os.path.join("one", sorted(names)[0])], cwd=work, check=True, capture_output=True)
check(len(rows("one")) == len(one["trials"]), "safety.csv has every trial")

# ---- the same by any way
call(slope, "-o", "two", "--jobs", "2", *WIDE)
two = answer("two")
check((two["stands"], two["fails"]) == (one["stands"], one["fails"]), "two trials at a time: the same bracket")
# The trial that goes on for the picture has more looks; those of both calls are the same.
common = rows("one").keys() & rows("two").keys()
check(len(common) >= 5 and all(rows("one")[f] == rows("two")[f] for f in common), "and the same numbers of the trials of both")

before = table("one")
again = call(slope, "-o", "one", "--jobs", "1", *WIDE)
check(again.stdout.count("there already") == len(one["trials"]) and table("one") == before, "the same command once more runs nothing anew")

mirrored = scene("mirrored", mirrored=True)
call(mirrored, "-o", "mirrored", *WIDE)
other = answer("mirrored")
check((other["stands"], other["fails"]) == (one["stands"], one["fails"]), f"the mirrored slope: {other['stands']} to {other['fails']}")

# Soil twice as strong has twice the factor: here on a grid of its own.
strong = scene("strong", cohesion=20e3, tangent=2 * math.tan(math.radians(20)))
call(strong, "-o", "strong", *WIDE[:2], "--to", "4", *WIDE[4:])
twice = answer("strong")
check(abs(twice["factor"] - 2 * one["factor"]) <= 0.02 + 2 * 0.02 + 1e-9, f"twice the strength: {twice['factor']} of {one['factor']}")

codes = runs.kill(("safety", slope, "-o", "killed", "--jobs", "1", *WIDE), 8, 0.05, 0.6, seed=7, signals=(signal.SIGTERM, signal.SIGKILL))
check(all(c in (0, 5, -signal.SIGKILL, -signal.SIGTERM) for c in codes), f"killed: {codes}")
call(slope, "-o", "killed", "--jobs", "1", *WIDE)
check(table("killed") == before, "after eight kills: the same bytes of safety.csv")
code, said, _ = runs.stop(("safety", slope, *WIDE), "stopped", lambda there: glob.glob(there + "/runs/*/history.csv"))
check(code == 5 and "goes on from here" in said, f"a stop: exit {code}")

# ---- outside the range
above = call(slope, "-o", "above", "--to", "1.1", "--bracket", "0.2")
beyond = answer("above")
check(
    "above 1.1" in above.stdout and beyond["factor"] is None and beyond["stands"] == 1.1 and beyond["fails"] is None,
    "it holds in all the range",
)
below = call(slope, "-o", "below", "--from", "1.6", "--to", "2", "--bracket", "0.2")
beyond = answer("below")
check(
    "below 1.6" in below.stdout and beyond["factor"] is None and beyond["fails"] == 1.6 and beyond["stands"] is None,
    "it fails in all the range",
)

# ---- a stage: a berm before the toe goes
BERM = """[[body]]
name = "berm"
soil = "soil"
polygon = { points = [[24.0, 3.0], [30.0, 0.0], [45.0, 0.0], [39.0, 3.0]] }
stress = "at rest"
"""
staged = scene("staged", body=BERM, more='[[event]]\nat = 0.2\nremove = "berm"')
call(staged, "-o", "with", "--at", "0.1", "--bracket", "0.1")
call(staged, "-o", "without", "--at", "0.3", "--bracket", "0.1")
propped, free = answer("with"), answer("without")
check(propped["stands"] >= free["fails"], f"the berm holds the slope: {propped['factor']} with it, {free['factor']} without")
check(
    free["stands"] <= one["fails"] and free["fails"] >= one["stands"],
    f"without it the slope is the first one's: {free['stands']} to {free['fails']}",
)


# ---- what is refused leaves nothing
def refused(words, *args):
    done = call(*args, "-o", "refused", expect=2)
    check(all(w in done.stderr for w in words), f"{words}: {done.stderr.strip()[-300:]}")
    check(not os.path.exists(os.path.join(work, "refused")) and not os.path.exists(os.path.join(work, "results")), "and nothing is left")


refused(["--at", "event"], staged)
refused(["--at"], slope, "--at", "-1")
MOVED = """[[wall]]
name = "plate"
box = { low = [34.0, 0.0, 0.0], high = [38.0, 0.0, 8.0] }
"""
pushed = scene("pushed", body=MOVED, more='[[event]]\nfrom = 0.1\nto = 0.2\nmove = { wall = "plate", velocity = [1.0, 0.0, 0.0] }')
refused(["--at 0.3", "plate", "moved"], pushed, "--at", "0.3")
refused(["--bracket"], slope, "--bracket", "0")
refused(["--bracket"], slope, "--bracket", "nan")
refused(["--bracket"], slope, "--from", "1", "--to", "1.1", "--bracket", "0.2")
refused(["--from", "--to"], slope, "--from", "2", "--to", "1")
refused(["--from", "--to"], slope, "--from", "0")
refused(["--to"], slope, "--to", "inf")
refused(["gravity"], scene("weightless", gravity="", stress="none"))
refused(["start.from", "nothing"], scene("homeless", more='[start]\nfrom = "nowhere"'))
refused(["strength"], scene("water", cohesion=0.0, tangent=0.0))
other = call(strong, "-o", "one", expect=2)
check("another scene" in other.stderr and table("one") == before, "another scene in the same directory")
call(slope, "-o", "one", "--from", "0.6", expect=2)
shutil.copytree(os.path.join(work, "one", "runs", "settled"), os.path.join(work, "run"))
check("other things" in call(slope, "-o", "run", expect=2).stderr, "a run's own directory")
numbers = [float(r["factor"]) for r in csv.DictReader(line for line in table("one").splitlines() if not line.startswith("#"))]
check(numbers == sorted(numbers), "safety.csv is in the order of the factors")
finish()
