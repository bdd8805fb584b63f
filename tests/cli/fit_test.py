#!/usr/bin/python3
"""kuzure fit: finds the friction of an event from its outline alone, goes on from kills to the same bytes, says where the best is the end of
the range, and refuses what it cannot use without writing anything."""
import csv
import json
import math
import os
import shutil
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, scratch
from runs import Runs

work = scratch("fit")
TRUE = 17.3  # deg, of the event; no value of the even scan
HEAP = """title = "a slab on a floor"
dimensions = 3
[space]
spacing = 0.1
[time]
end = {end}
[soil.sand]
density = 1850.0
young = 3.0e5
poisson = 0.3
friction_angle = 25.0
[[body]]
soil = "sand"
box = {{ low = [0.0, 0.0, 0.0], high = [0.8, 0.8, 0.6] }}
velocity = [2.5, 0.0, 0.0]
[[wall]]
box = {{ low = [-1.0, -1.0, -0.3], high = [4.0, 1.8, 0.0] }}
surface = {surface}
[effects]
gravity = [0.0, 0.0, -9.81]
viscosity = {{ alpha = 0.1 }}
[maps]
wet = 0.1
cell = 0.2
limits = [0.1]
{more}
"""


runs = Runs(work)
call = runs.call


def scene(name, friction=25.0, end=1.0, more="", surface=None):
    runs.scene(name, HEAP.format(end=end, more=more, surface=surface or f"{{ friction_angle = {friction} }}"))
    return name + ".toml"


def answer(directory):
    return runs.json(directory, "fit.json")


def kept(directory):
    """What does not tell times."""
    j = answer(directory)
    return runs.read(directory, "curve.csv"), [
        j[k] for k in ("best", "interval", "misfit", "best_run", "alike", "particles_elsewhere", "at_end_of_range")
    ]


# ---- an event of known friction, of which only the outline is given
call("run", scene("event", TRUE), "-o", "event", "--quiet")
outline = os.path.join("event", "maps", "outline_0.1.shp")
unknown = scene("unknown")
done = call("fit", unknown, "--observed", outline, "--input", "bed_friction=8,32", "-o", "found")
found = answer("found")
check(abs(found["best"] - TRUE) < 1, f"the friction of the event, {TRUE} deg, is found within a degree: {found['best']}")
low, high = found["interval"]
check(low <= TRUE <= high and high - low < 8, f"and lies in an interval that says something: {low} to {high}")
check(found["best_run"]["overlap"] > 0.9 and abs(found["best_run"]["reach_error"]) < 0.1, f"the best run covers it: {found['best_run']}")
check(len(found["misfit"]) >= 9 + 6 and found["misfit"] == sorted(found["misfit"]), "the curve: nine values, then closer ones, in order")
check({v for v, m in found["misfit"]} >= {8 + 3 * k for k in range(9)}, "the even scan is in it")
worst = {v: m for v, m in found["misfit"]}
check(worst[8] > 0.1 and worst[32] > 0.1, f"both ends are worse: {worst[8]}, {worst[32]}")
check(
    found["alike"]["misfit"] == max(found["alike"]["cells"], found["alike"]["curve"]) and not found["particles_elsewhere"],
    f"what says nothing is measured, boxes having no particles at other places: {found['alike']}",
)
check("best: bed_friction" in done.stdout and "cannot be told apart" in done.stdout, "the terminal says what it means")
with open(os.path.join(work, "found", "curve.csv"), newline="") as f:
    rows = [r for r in csv.DictReader(f) if not r["run"].startswith("#")]
check([float(r["misfit"]) for r in rows] == [round(m, 6) for v, m in found["misfit"]], "curve.csv is the curve")
short = [r for r in rows if float(r["bed_friction"]) == 32]
check(float(short[0]["reach_error"]) < 0 < float(rows[0]["reach_error"]), "too much friction stops short, too little goes too far")
with open(os.path.join(work, "found", "report.html")) as f:
    page = f.read()
check('lang="ja"' in page and "<svg" in page and "data:image/png" in page, "a page in two languages with curve and map")
call("report", os.path.join("found", "runs", "001"))

# ---- kills and goings on
command = ("fit", unknown, "--observed", outline, "--input", "bed_friction=8,32")
runs.kill((*command, "-o", "killed"), 6, 0.2, 1.5, seed=3)
call(*command, "-o", "killed", "--jobs", "1")
check(kept("killed") == kept("found"), "killed at six moments, gone on with one run at a time: the same answer")
again = call(*command, "-o", "found")
check("there already" in again.stdout and kept("found") == kept("killed"), "once more: nothing is run again")
call("fit", unknown, "--observed", outline, "--input", "bed_friction=8,30", "-o", "found", expect=2)
call("fit", scene("other", end=0.9), "--observed", outline, "--input", "bed_friction=8,32", "-o", "found", expect=2)
check(kept("found") == kept("killed"), "another range or scene does not go on in this directory")

# ---- the best at the end of the range
done = call("fit", unknown, "--observed", outline, "--input", "bed_friction=22,32", "--values", "3", "-o", "end")
end = answer("end")
check(end["at_end_of_range"] and end["interval"] is None and end["best"] == 22, f"no interval at the end of the range: {end['best']}")
check("end of the range" in done.stdout and "wider" in done.stdout, "and it says so, with the remedy")

# ---- a deposit, two inputs, coarser, by a deadline
call(
    "fit",
    unknown,
    "--observed",
    os.path.join("event", "maps", "h_end.tif"),
    "--input",
    "bed_friction=12,24",
    "--values",
    "4",
    "-o",
    "deposit",
)
deposit = answer("deposit")
check(abs(deposit["best"] - TRUE) < 1 and deposit["observed"]["kind"] == "deposit", f"from the deposit: {deposit['best']}")
check(deposit["best_run"]["rms_thickness"] < 0.05, f"with the error of its thickness: {deposit['best_run']}")
both = scene("both", more="[uncertain]\nbed_friction = { low = 8.0, likely = 20.0, high = 32.0 }\n")
call(
    "fit",
    both,
    "--observed",
    outline,
    "--input",
    "bed_friction",
    "--input",
    "thickness=0.5,1.5",
    "--values",
    "3",
    "--layers",
    "3",
    "-o",
    "two",
)
two = answer("two")
check(set(two["best"]) == {"bed_friction", "thickness"} and len(two["misfit"][0]) == 3, f"two inputs: {two['best']}")
check(two["layers"] < 4 and len(two["misfit"]) > 9, "with the layers asked for, the scan and closer")
deadline = f"{math.ceil(max(10, found['ended_seconds']))}s"  # fewer runs than the first search had: time for them here
call("fit", unknown, "--observed", outline, "--within", deadline, "--input", "bed_friction=8,32", "--values", "5", "-o", "soon")
soon = answer("soon")
check(8 <= soon["best"] <= 32 and soon["layers"] < 6.01, f"by a deadline: {soon['best']} with {soon['layers']:.3g} layers")


# ---- what is refused leaves nothing
def refused(name, *words, args=(), path=None, observed=outline):
    done = call("fit", path or unknown, "--observed", observed, "-o", name + "-out", *args, expect=2)
    check(all(w in done.stderr for w in words), f"{name}: {words} in {done.stderr.strip()[:400]}")
    check(not os.path.exists(os.path.join(work, name + "-out")), f"{name}: nothing is written")


def ring(name, corners, **more):
    with open(os.path.join(work, name), "w") as f:
        json.dump({"type": "Polygon", "coordinates": [corners], **more}, f)
    return name


refused("no-file", "no.shp", "--observed", observed="no.shp")
refused(
    "a-table", "table.csv", observed=shutil.copy(os.path.join(work, "found", "curve.csv"), os.path.join(work, "table.csv")) and "table.csv"
)
refused("elsewhere", "another", "beside", observed=ring("far.geojson", [[50, 50], [60, 50], [60, 60], [50, 50]], crs=None))
refused("on-the-globe", "coordinate system", observed=ring("globe.geojson", [[0, 0], [1, 0], [1, 1], [0, 0]]))
refused("open-ring", "open", observed=ring("open.geojson", [[0, 0], [1, 0], [1, 1], [0, 1]], crs=None))
refused("unknown-input", "--input bed", "bed_friction", args=("--input", "bed"))
refused("key", "[[uncertain.key]]", args=("--input", "soil.sand.cohesion=0,100"))
refused("three", "one or two", args=("--input", "friction", "--input", "thickness", "--input", "bed_friction"))
refused("twice", "twice", args=("--input", "friction", "--input", "friction"))
for wrong in ("5", "30,20", "a,b", "1,2,3", "nan,3", "20,95", "-3,20"):
    refused("range", "--input", args=("--input", f"bed_friction={wrong}"))
refused("factor", "0.1 to 10", args=("--input", "thickness=0,2"))
refused("layers", "--layers", args=("--layers", "3,4"))
refused("time", "--within", args=("--within", "soon"))
refused("smooth", "bed_friction", "Coulomb", path=scene("smooth", surface='"smooth"'))
with open(os.path.join(work, "no_maps.toml"), "w") as f:
    f.write(HEAP.format(end=1.0, more="", surface="{ friction_angle = 20.0 }").split("[maps]")[0])
refused("no-maps", "[maps]", path="no_maps.toml")
call("fit", unknown, "-o", "nothing", expect=2)
os.makedirs(os.path.join(work, "mine"))
open(os.path.join(work, "mine", "letter.txt"), "w").close()
call(*command, "-o", "mine", expect=2)
check(os.listdir(os.path.join(work, "mine")) == ["letter.txt"], "nor in a directory with other things")

# ---- where every run fails
box = scene("box", more="").replace(".toml", "")
with open(os.path.join(work, "box.toml")) as f:
    text = f.read().replace("spacing = 0.1\n", "spacing = 0.1\nlow = [-1.5, -1.5, -0.5]\nhigh = [0.85, 1.9, 2.0]\n", 1)
with open(os.path.join(work, "box.toml"), "w") as f:
    f.write(text)
done = call("fit", "box.toml", "--observed", outline, "--input", "bed_friction=8,32", "--values", "3", "-o", "hopeless", expect=3)
check("no run" in done.stderr, f"without a single run there is no answer: {done.stderr.strip()[:200]}")
finish()
