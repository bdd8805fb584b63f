#!/usr/bin/python3
"""Events while a run goes on, forces on named walls, probes: the same bits on any ranks, threads and restarts between stages, a closed
ledger, momentum to the last digits, and exit 2 for what contradicts itself. Run as stages_test.py PROGRAM [PART...]."""
import json
import os
import re
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, digest, program, scratch
from runs import Runs, run_parts

work = scratch("stages")

DUG = """title = "excavation in three stages"
dimensions = 2
[space]
spacing = 0.25
[time]
end = 0.6
[soil.clay]
density = 1900.0
young = 2.0e7
poisson = 0.3
cohesion = 2.0e4
friction_angle = 25.0
cone = "plane strain"
[[body]]
soil = "clay"
box = { low = [0.0, 0.0, 0.0], high = [4.0, 0.0, 4.0] }
stress = "at rest"
[[body]]
name = "cut 1"
soil = "clay"
box = { low = [4.0, 0.0, 3.0], high = [8.0, 0.0, 4.0] }
stress = "at rest"
[[body]]
name = "cut 2"
soil = "clay"
box = { low = [4.0, 0.0, 2.0], high = [8.0, 0.0, 3.0] }
stress = "at rest"
[[body]]
name = "base"
soil = "clay"
box = { low = [4.0, 0.0, 0.0], high = [8.0, 0.0, 2.0] }
stress = "at rest"
[[wall]]
name = "floor"
box = { low = [-1.0, 0.0, -1.0], high = [9.0, 0.0, 0.0] }
[[wall]]
name = "left"
box = { low = [-1.0, 0.0, 0.0], high = [0.0, 0.0, 5.0] }
surface = "smooth"
[[wall]]
name = "right"
box = { low = [8.0, 0.0, 0.0], high = [9.0, 0.0, 5.0] }
surface = "smooth"
[effects]
gravity = [0.0, 0.0, -9.81]
viscosity = { alpha = 0.1 }
[accuracy]
cfl = 0.5
[output]
history = 0.02
every = 0.2
"""
# what is there for a while only
FILL = """[[body]]
name = "fill"
soil = "clay"
box = { low = [6.5, 0.0, 2.0], high = [8.0, 0.0, 2.5] }
"""
STRUT = """[[wall]]
name = "strut"
box = { low = [4.5, 0.0, 3.0], high = [5.5, 0.0, 4.0] }
"""
EXCAVATION = DUG.replace("[effects]", FILL + STRUT + "[effects]")
STAGES = """[[event]]
at = 0.1
remove = "cut 1"
[[event]]
at = 0.25
remove = ["cut 2"]
add = "strut"
[[event]]
from = 0.3
to = 0.45
[event.soil.clay]
strength = 0.5
stiffness = 0.7
[[event]]
from = 0.35
to = 0.5
gravity = [2.0, 0.0, -9.81]
[[event]]
at = 0.4
add = "fill"
[[event]]
at = 0.5
damping = 0.2
[[probe]]
name = "toe"
point = [3.9, 0.0, 2.0]
[[probe]]
body = "base"
[[probe]]
particle = 10
"""
# one soil that flows, or slides, in 2-D
BLOCK = """title = "a block"
dimensions = 2
[space]
spacing = 0.1
{space}
[time]
end = {end}
[soil.sand]
density = 1800.0
young = 2.0e6
poisson = 0.3
cohesion = {cohesion}
friction_angle = 30.0
cone = "shear"
[[body]]
name = "block"
soil = "sand"
box = {{ low = [0.0, 0.0, 0.0], high = [{width}, 0.0, 1.0] }}
{body}
[[wall]]
name = "floor"
box = {{ low = [-4.0, 0.0, -0.4], high = [8.0, 0.0, 0.0] }}
{wall}
[effects]
gravity = {gravity}
viscosity = {{ alpha = 0.1 }}
{effects}
[output]
history = {history}
[[probe]]
body = "block"
{more}
"""


def block(end=0.5, cohesion=0.0, width=1.0, body="", wall="", gravity="[0.0, 0.0, -9.81]", effects="", history=0.01, space="", more=""):
    return BLOCK.format(**locals())


runs = Runs(work)
scene, run, summary, raw, table, unaccounted = runs.scene, runs.run, runs.summary, runs.raw, runs.table, runs.unaccounted
TABLES = ("history.csv", "events.csv", "forces.csv", "probes.csv")


def excavation():
    path = scene("excavation", EXCAVATION + STAGES)
    notes = json.loads(subprocess.run([program, "check", path, "--json"], capture_output=True, text=True, check=True).stdout)
    events = [n["why"] for n in notes["effects"]["on"] if n["name"] == "event"]
    check(
        len(events) == 6 and events[1] == "at t = 0.25 s: body cut 2 is removed; wall strut is added",
        f"check tells the events: {events[1]}",
    )
    out = run(path, "one").stdout
    check("t = 0.1 s, event 0: body cut 1 is removed" in out, "the run says what happens")
    one = summary("one")
    for ranks, threads in ((1, 2), (2, 1), (4, 1), (7, 1)):
        other = f"{ranks}x{threads}"
        run(path, other, ranks, threads, ["--recut-every", "3"])
        check(summary(other)["state_hash"] == one["state_hash"], f"{other}: the bits of 1 x 1")
        for name in TABLES:
            check(raw(other, name) == raw("one", name), f"{other}: the same {name}")
    # a restart between stages, and after them
    run(path, "legs", extra=["--set", "time.end=0.25"])
    run(path, "legs", 2, extra=["--restart", "--set", "time.end=0.4"])
    run(path, "legs", extra=["--restart"])
    check(summary("legs")["state_hash"] == one["state_hash"], "three stages in three legs: the bits of one run")
    rows = lambda out, name: raw(out, name).splitlines()  # noqa: E731
    for name in TABLES[1:]:
        check(set(rows("one", name)) <= set(rows("legs", name)), f"three legs: {name} has the rows of one run")
    check(len(rows("legs", "events.csv")) == len(rows("one", "events.csv")) == 8, "no event is told twice")
    run(path, "later", extra=["--set", "event.0.at=0.11"])
    check(summary("later")["state_hash"] != one["state_hash"], "an event at another time gives other bits")

    excess, largest = unaccounted("one")
    worst = max(map(abs, excess)) / largest
    check(worst < 1e-3, f"the ledger closes through every event: {worst:.2e} of the largest energy")
    check(abs(one["energy"]["events"]) > 1, f"which took {one['energy']['events']:.1f} J")
    probes = table("one", "probes.csv")
    base = [r for r in probes if r["probe"] == 1]
    check(base[-1]["particles"] == 128 and base[-1]["stress_zz"] > 1.5 * base[0]["stress_zz"], "the base is unloaded")
    strut = [r for r in table("one", "forces.csv") if r["wall"] == "strut"]
    check(all(r["impulse_x"] == 0 for r in strut if r["time"] <= 0.25), "a wall that is not there bears nothing")


def other_ways():
    """The same stages by Bui's leap-frog, with soil that may sleep, with retry, in three dimensions with maps."""
    if not os.path.exists(runs.path("one")):
        run(scene("excavation", EXCAVATION + STAGES), "one")
    for name, more in (
        ("leap-frog", '[accuracy]\nscheme = "leap-frog"\ncfl = 0.2\n'),
        ("sleeping", "[accuracy]\ncfl = 0.5\nsleep_below = 0.001\n"),
        ("retry", None),
    ):
        text = EXCAVATION + STAGES
        if more:
            text = text.replace("[accuracy]\ncfl = 0.5\n", more)
        else:
            text = text.replace("end = 0.6\n", "end = 0.6\nretry = true\n")
        path = scene(name, text)
        run(path, name)
        run(path, name + " 2", 2, extra=["--recut-every", "3"])
        check(summary(name)["state_hash"] == summary(name + " 2")["state_hash"], f"{name}: the bits of two ranks are those of one")
        check(raw(name, "events.csv") == raw(name + " 2", "events.csv"), f"{name}: the same events")
        run(path, name + " legs", extra=["--set", "time.end=0.25"])
        run(path, name + " legs", extra=["--restart"])
        check(summary(name)["state_hash"] == summary(name + " legs")["state_hash"], f"{name}: two legs, the bits of one run")
        # what mirrored walls of the published scheme do is booked, and no part of this
        excess, largest = unaccounted(name)
        worst = max(map(abs, excess)) / largest
        check(worst < (1e-2 if name == "leap-frog" else 1e-3), f"{name}: the ledger closes: {worst:.1e}")
    check(summary("retry")["state_hash"] == summary("one")["state_hash"], "retry that is not needed changes no bit")
    base = lambda out: [r for r in table(out, "probes.csv") if r["probe"] == 1][-1]["stress_zz"]  # noqa: E731
    for name in ("leap-frog", "sleeping"):
        check(abs(base(name) / base("one") - 1) < 0.05, f"{name}: the base bears {base(name):.0f} Pa, {base('one'):.0f} Pa above")
    solid = (
        EXCAVATION.replace("dimensions = 2", "dimensions = 3")
        .replace("spacing = 0.25", "spacing = 0.5")
        .replace(", 0.0, 0.0] }", ", 2.0, 0.0] }")
    )
    solid = re.sub(r"(low = \[[-0-9.]+), 0.0,", r"\1, 0.0,", solid)
    solid = re.sub(r"(high = \[[-0-9.]+), [0-9.]+,", r"\1, 2.0,", solid)
    solid += STAGES.replace("[3.9, 0.0, 2.0]", "[3.9, 1.0, 2.0]") + "[maps]\ncell = 1.0\n"
    path = scene("solid", solid)
    run(path, "solid")
    for other, ranks in (("solid 2", 2), ("solid 4", 4)):
        run(path, other, ranks)
        check(summary(other)["state_hash"] == summary("solid")["state_hash"], f"{other}: the same bits in three dimensions")
        check(digest(runs.path(other), []) == digest(runs.path("solid"), []), f"{other}: the same maps to the byte")


def momentum():
    """What walls gave in all is what soil lost: to the last digits."""
    path = scene("thrown", block(body="velocity = [0.5, 0.0, -1.0]", end=0.3))
    run(path, "thrown")
    mass, g = 1800.0, 9.81
    probes, forces = table("thrown", "probes.csv"), table("thrown", "forces.csv")
    worst = 0
    for p, f in zip(probes, forces):
        lost = (mass * (0.5 - p["velocity_x"]), mass * (-1.0 - g * p["time"] - p["velocity_z"]))
        worst = max(worst, abs(f["impulse_x"] - lost[0]), abs(f["impulse_z"] - lost[1]))
    check(worst < 1e-10 * mass, f"impulse on the floor against momentum lost: {worst / mass:.1e} of it")
    check(forces[-1]["impulse_z"] < -mass, "the floor stopped it")

    box = """[[wall]]
name = "left"
box = { low = [-0.4, 0.0, 0.0], high = [0.0, 0.0, 1.6] }
surface = "smooth"
[[wall]]
name = "right"
box = { low = [1.0, 0.0, 0.0], high = [1.4, 0.0, 1.6] }
surface = "smooth"
"""
    path = scene("resting", block(body='stress = "at rest"', more=box, effects="damping = { ratio = 0.5, until = 0.3 }", end=0.6))
    run(path, "resting")
    rows = {(r["wall"], round(r["time"], 2)): r for r in table("resting", "forces.csv")}
    times = sorted({t for w, t in rows if t >= 0.35})
    first, last = rows["floor", times[0]], rows["floor", times[-1]]
    weight = -(last["impulse_z"] - first["impulse_z"]) / (last["time"] - first["time"])
    check(abs(weight / (mass * g) - 1) < 1e-3, f"weight on the floor: {weight / (mass * g):.6f} of the soil's")
    arm = rows["floor", times[-1]]["moment_y"] / rows["floor", times[-1]]["force_z"]
    check(abs(-arm - 0.5) < 0.01, f"it acts in the middle, at x = {-arm:.4f} m")
    sides = [rows[w, times[-1]]["force_x"] for w in ("left", "right")]
    check(sides[0] < 0 < sides[1] and abs(sum(sides)) < 0.02 * sides[1], f"both sides bear as much: {sides[0]:.0f}, {sides[1]:.0f} N/m")


def gate():
    wall = """[[wall]]
name = "gate"
box = { low = [1.0, 0.0, 0.0], high = [1.4, 0.0, 1.6] }
surface = "smooth"
[[wall]]
box = { low = [-0.4, 0.0, 0.0], high = [0.0, 0.0, 1.6] }
surface = "smooth"
"""
    held = block(body='stress = "at rest"', more=wall + '[[event]]\nat = 0.1\nremove = "gate"\n')
    free = block(body='stress = "at rest"', more="[[wall]]" + wall.split("[[wall]]")[2], end=0.4)
    run(scene("held", held), "held")
    run(scene("free", free), "free")
    front = lambda out, t: min(table(out, "history.csv"), key=lambda r: abs(r["time"] - t))["front_max_x"]  # noqa: E731
    before, after, never = front("held", 0.1), front("held", 0.5), front("free", 0.4)
    check(before < 1.05, f"the gate holds: front at {before:.3f} m")
    check(after > 1.25 and abs(after - never) < 0.1, f"0.4 s after: {after:.3f} m, without a gate ever {never:.3f} m")
    # a wall put where soil stands
    back = block(more=wall + '[[event]]\nat = 0.05\nremove = "gate"\n[[event]]\nat = 0.45\nadd = "gate"\n', body='stress = "at rest"')
    done = run(scene("back", back), "back", expect=3)
    check("wall gate is added" in done.stderr and "where soil stands" in done.stderr, "a wall does not come to stand in soil")


def refused():
    event = lambda lines: DUG + "[[event]]\n" + lines  # noqa: E731
    two = lambda a, b: event(a) + "\n[[event]]\n" + b  # noqa: E731
    runs.write("wild.csv", "time,x\n0,0\n0.1,1e300\n")
    runs.write("late.csv", "time,x\n0,0\n1e300,1\n")
    wrong = {
        "unknown name": (event('at = 0.1\nremove = "gate"'), 'found "gate"'),
        "unknown soil": (event("at = 0.1\n[event.soil.caly]\ncohesion = 1.0"), 'did you mean "clay"'),
        "unknown key": (event("at = 0.1\ngravty = [0.0, 0.0, 1.0]"), 'did you mean "gravity"'),
        "no time": (event('remove = "floor"'), "expected either at, or from and to"),
        "two times": (event('at = 0.1\nfrom = 0.2\nto = 0.3\nremove = "floor"'), "expected either at, or from and to"),
        "backwards": (event("from = 0.3\nto = 0.2\ngravity = [0.0, 0.0, -5.0]"), "expected from < to"),
        "nothing": (event("at = 0.1"), "expected something that changes"),
        "wrong type": (event('at = "soon"\nremove = "floor"'), "event.0.at"),
        "slow removal": (event('from = 0.1\nto = 0.2\nremove = "floor"'), "happens at once"),
        "gone twice": (two('at = 0.1\nremove = "cut 1"', 'at = 0.2\nremove = "cut 1"'), "gone already"),
        "there already": (two('at = 0.1\nremove = "left"', 'at = 0.1\nadd = "left"'), "one event at a time"),
        "both at once": (
            two("at = 0.1\ngravity = [0.0, 0.0, -1.0]", "from = 0.05\nto = 0.2\ngravity = [0.0, 0.0, -2.0]"),
            "one event at a time",
        ),
        "strength and cohesion": (event("at = 0.1\n[event.soil.clay]\nstrength = 0.5\ncohesion = 1.0"), "expected strength or its parts"),
        "no strength left": (event("at = 0.1\n[event.soil.clay]\ncohesion = 0.0\nfriction_angle = 0.0"), "a soil with strength"),
        "no water": (event("at = 0.1\nwater = [[0.0, 1.0]]"), "expected a scene with still water"),
        "no record": (event('at = 0.1\nshaking = "nothing.csv"'), "nothing.csv"),
        "a record of other units": (event('at = 0.1\nshaking = "wild.csv"'), "wild.csv:3: expected at most 1e+06 m/s^2"),
        "a record without end": (event('at = 0.1\nshaking = "late.csv"'), "late.csv:3: expected at most 1e+09 s"),
        "gravity along y": (event("at = 0.1\ngravity = [0.0, 1.0, -9.81]"), "no gravity along y"),
        "stress added": (event('at = 0.1\nadd = "base"'), "expected a body without stress"),
        "name twice": (DUG.replace('name = "left"', 'name = "floor"'), "no other wall, body or load has"),
        "probe of two": (DUG + '[[probe]]\nbody = "base"\nparticle = 3\n', "exactly one of point, particle, body"),
        "probe of nothing": (DUG + "[[probe]]\nparticle = 100000\n", "an id from 0 to"),
        "overlap": ((EXCAVATION + STAGES).replace("low = [6.5, 0.0, 2.0]", "low = [6.5, 0.0, 1.5]"), "an overlap"),
    }
    runs.refused(wrong)


if __name__ == "__main__":
    run_parts(excavation, other_ways, momentum, gate, refused)
