#!/usr/bin/python3
"""Walls that events move: the same bits on any ranks, threads and restarts, the same answer seen from a train, work that is force times
velocity, a ledger that closes, active and passive earth pressure, a gate that is lifted, and exit 2 for what no wall can do. Run as
moving_walls_test.py PROGRAM [PART...]."""
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, scratch
from runs import Runs, run_parts

runs = Runs(scratch("moving"))
scene, run, summary, raw, table, unaccounted = runs.scene, runs.run, runs.summary, runs.raw, runs.table, runs.unaccounted

TRAY = """title = "soil in a tray"
dimensions = 2
[space]
spacing = {d}
[time]
end = {end}
{time}
[soil.sand]
density = 1600.0
young = {young}
poisson = 0.3
cohesion = {cohesion}
friction_angle = 30.0
cone = "plane strain"
[[body]]
soil = "sand"
box = {{ low = [0.0, 0.0, 0.0], high = [{length}, 0.0, 1.0] }}
stress = "at rest"
velocity = [{speed}, 0.0, 0.0]
[[wall]]
name = "floor"
box = {{ low = [-1.0, 0.0, -0.4], high = [{far}, 0.0, 0.0] }}
{floor}
[[wall]]
name = "plate"
box = {{ low = [-0.4, 0.0, 0.0], high = [0.0, 0.0, 1.6] }}
{plate}
[[wall]]
name = "back"
box = {{ low = [{length}, 0.0, 0.0], high = [{far}, 0.0, 1.6] }}
surface = "smooth"
[effects]
gravity = [0.0, 0.0, {g}]
viscosity = {{ alpha = 0.1 }}
{effects}
[output]
history = {history}
{more}
"""


def tray(end=0.3, d=0.1, cohesion=0.0, length=2.0, speed=0.0, floor='surface = "smooth"', plate=None, g=-9.81, effects="", **other):
    values = {"time": "", "more": "", "history": 0.01, "far": length + 0.4, "young": "4.0e6", **other}
    return TRAY.format(
        end=end, d=d, cohesion=cohesion, length=length, speed=speed, floor=floor, plate=plate or floor, g=g, effects=effects, **values
    )


def move(wall, velocity=(0.0, 0.0, 0.0), begin=0.0, end=10.0, rotation=""):
    return f"""[[event]]
from = {begin}
to = {end}
move = {{ wall = "{wall}", velocity = [{', '.join(map(str, velocity))}]{rotation} }}
"""


def without(text, wall):
    """The scene less the wall of this name."""
    head, *walls = text.split("[[wall]]")
    walls[-1], rest = walls[-1].split("[effects]")
    left = [w for w in walls if f'name = "{wall}"' not in w]
    return "[[wall]]".join([head, *left]) + "[effects]" + rest


COULOMB = "surface = { friction_angle = 20.0 }"


def bits():
    """A plate that pushes, turns and comes back, beside a floor with friction and soil that flows."""
    events = (
        move("plate", (0.6, 0.0, 0.1), 0.05, 0.15, ", rotation = { center = [0.0, 0.0, 0.0], rate = 60.0 }")
        + move("plate", (-0.4, 0.0, 0.0), 0.15, 0.25, ", rotation = { center = [0.0, 0.0, 0.5], rate = -90.0 }")
        + move("back", (0.3, 0.0, 0.0), 0.1, 0.2)
    )
    path = scene("bits", tray(floor=COULOMB, more=events))
    run(path, "one")
    one = summary("one")
    for ranks, threads in ((1, 2), (2, 1), (4, 1), (7, 1)):
        other = f"{ranks}x{threads}"
        run(path, other, ranks, threads, ["--recut-every", "3"])
        check(summary(other)["state_hash"] == one["state_hash"], f"{other}: the bits of 1 x 1")
        for name in ("history.csv", "forces.csv", "events.csv"):
            check(raw(other, name) == raw("one", name), f"{other}: the same {name}")
    run(runs.path("one", "scene.toml"), "written")
    check(summary("written")["state_hash"] == one["state_hash"], "the scene that the run has written is the one it was given")
    # restarts where events begin and end, and from a checkpoint in the middle of a motion
    run(path, "legs", extra=["--set", "time.end=0.1"])
    run(path, "legs", 2, extra=["--restart", "--set", "time.end=0.15"])
    run(path, "legs", extra=["--restart"])
    check(summary("legs")["state_hash"] == one["state_hash"], "three legs: the bits of one run")
    ends = runs.in_legs(path, "stopped", one["wall_seconds"])
    steps = [e["steps"] for e in ends]
    check(0 < steps[0] < one["steps"] and steps == sorted(set(steps)), f"a run stopped after {steps[:-1]} of {one['steps']} steps")
    check(ends[-1]["state_hash"] == one["state_hash"], f"and taken up {len(ends) - 1} times: the bits of one run")


def train():
    """All walls and the soil pass by with one velocity: what the soil does is what it does at rest."""
    v = 3.0
    for name, walls in (("smooth", 'surface = "smooth"'), ("rough", 'surface = "rough"'), ("coulomb", COULOMB)):
        for precision, most in (("double", 1e-9), ("mixed", 2e-3)):
            time = f'step = 0.0008\n[accuracy]\nprecision = "{precision}"'
            kind = {"end": 0.1, "cohesion": 3e4, "floor": walls, "time": time, "history": 0.02}
            run(scene("rest", tray(**kind)), "rest", extra=["--force"])
            passing = tray(speed=v, more="".join(move(w, (v, 0, 0)) for w in ("floor", "plate", "back")), **kind)
            run(scene("train", passing), "train", extra=["--force"])
            here, there = table("rest", "forces.csv"), table("train", "forces.csv")
            largest = max(abs(r["impulse_z"]) for r in here)
            worst = max(abs(a[k] - b[k]) for a, b in zip(here, there) for k in ("impulse_x", "impulse_z")) / largest
            check(worst < most, f"{name}, {precision}: impulses on walls seen from a train: {worst:.1e} apart")
            # from the first step on: before it walls stood still in both
            rest, passing = unaccounted("rest")[0], unaccounted("train")[0]
            apart = max(abs((a - rest[1]) - (b - passing[1])) for a, b in zip(rest[1:], passing[1:])) / (0.5 * 3200 * v * v)
            check(
                apart < 1e-9 if precision == "double" else apart < 1e-6, f"{name}, {precision}: what the ledger misses: {apart:.1e} apart"
            )


def drawn_otherwise():
    """The same in the mirror, and with the plate cut in two that move alike: what the soil does is the same."""
    kind = {"end": 0.1, "cohesion": 3e4, "floor": 'surface = "rough"', "time": "step = 0.0008", "history": 0.02}
    turn = ", rotation = {{ center = [{}, 0.0, 0.0], rate = {} }}"
    run(scene("drawn", tray(more=move("plate", (0.2, 0.0, 0.0), 0.01, 10, turn.format(0.0, 5.0)), **kind)), "drawn")
    mirrored = tray(more=move("back", (-0.2, 0.0, 0.0), 0.01, 10, turn.format(2.0, -5.0)), **kind)
    mirrored = mirrored.replace('1.6] }\nsurface = "smooth"', '1.6] }\nsurface = "rough"').replace(
        'name = "plate"\nbox = { low = [-0.4, 0.0, 0.0], high = [0.0, 0.0, 1.6] }\nsurface = "rough"',
        'name = "plate"\nbox = { low = [-0.4, 0.0, 0.0], high = [0.0, 0.0, 1.6] }\nsurface = "smooth"',
    )
    # the floor reaches as far on either side
    run(
        scene(
            "mirrored", mirrored.replace("low = [-1.0, 0.0, -0.4]", "low = [-0.4, 0.0, -0.4]").replace("[2.4, 0.0, 0.0]", "[3.0, 0.0, 0.0]")
        ),
        "mirrored",
    )
    halves = tray(
        more=move("plate", (0.2, 0.0, 0.0), 0.01, 10, turn.format(0.0, 5.0))
        + move("above", (0.2, 0.0, 0.0), 0.01, 10, turn.format(0.0, 5.0)),
        **kind,
    ).replace("high = [0.0, 0.0, 1.6]", "high = [0.0, 0.0, 0.7]")
    above = '[[wall]]\nname = "above"\nbox = { low = [-0.4, 0.0, 0.7], high = [0.0, 0.0, 1.6] }\n'
    run(scene("cut", halves + above), "cut")

    def pushed(out, *walls):
        rows = [r for r in table(out, "forces.csv") if r["wall"] in walls]
        last = [r for r in rows if r["time"] == rows[-1]["time"]]
        return [sum(r[k] for r in last) for k in ("impulse_x", "impulse_z")], table(out, "history.csv")[-1]["moved_wall"]

    (x, z), work_done = pushed("drawn", "plate")
    check(work_done < -1, f"the plate gives {-work_done:.1f} J")
    for name, walls, turned in (("mirrored", ("back",), -1), ("cut", ("plate", "above"), 1)):
        (a, b), w = pushed(name, *walls)
        worst = max(abs(turned * a - x), abs(b - z)) / abs(x)
        check(worst < 1e-9 and abs(w / work_done - 1) < 1e-9, f"{name}: impulses {worst:.1e} apart, work {w / work_done - 1:.1e}")


def work():
    """A plate hits a block that floats: the work is force times velocity to the last digits, half the momentum's."""
    v = 0.5
    plate = tray(
        time="step = 0.0002", end=0.05, cohesion=1e6, length=1.0, g=0.0, history=0.001, more=move("plate", (v, 0, 0), 0.0), effects=""
    ).replace('stress = "at rest"', "")
    plate = without(without(plate, "floor"), "back")
    plate = plate.replace("high = [0.0, 0.0, 1.6]", "high = [0.0, 0.0, 2.0]").replace("[-0.4, 0.0, 0.0]", "[-0.4, 0.0, -1.0]")
    check("nothing will move" not in run(scene("hit", plate), "hit").stderr, "no word that nothing will move without gravity")
    rows, forces = table("hit", "history.csv"), table("hit", "forces.csv")
    worst = 0
    for r, f in zip(rows[1:], forces[1:]):
        worst = max(worst, abs(r["moved_wall"] - f["impulse_x"] * v))
    check(
        worst < 1e-9 * abs(rows[-1]["moved_wall"]), f"work against impulse times velocity: {worst / abs(rows[-1]['moved_wall']):.1e} of it"
    )
    check(rows[-1]["moved_wall"] < -0.4 * 1600 * v * v, f"the plate gives {-rows[-1]['moved_wall']:.0f} J")
    excess, largest = unaccounted("hit")
    check(max(map(abs, excess)) < 1e-3 * largest, f"the ledger closes: {max(map(abs, excess)) / largest:.1e}")
    check(abs(rows[-1]["wall"]) < 1e-3 * largest, f"as a wall that stands still it gives nothing: {rows[-1]['wall'] / largest:.1e}")


def smoothly():
    """A plate that comes to its speed in a ramp, and the same way as a path: the same push, and less of a shock."""
    speed, end, ramp = 0.1, 0.3, 0.1
    # stiff: the ledger counts elastic strains as small
    still = {"end": end, "cohesion": 3e4, "time": "step = 0.0002", "history": 0.002, "young": "4.0e7"}
    run(scene("sudden", tray(more=move("plate", (speed, 0, 0), 0.01, 0.21), **still)), "sudden")
    ramped = move("plate", (speed, 0, 0), 0.01, 0.21).replace("] }", f"], ramp = {ramp} }}")
    run(scene("ramped", tray(more=ramped, **still)), "ramped")
    # the parabolas of the ramp in rows
    rows, n = [], 200
    for k in range(n + 1):
        t = 0.2 * k / n
        s = t * t / (2 * ramp) if t < ramp else 0.1 - (0.2 - t) ** 2 / (2 * ramp)
        rows.append(f"{t:.17g},{speed * s:.17g},0")
    runs.write("path.csv", "time,x,z\n" + "\n".join(rows) + "\n")
    run(scene("path", tray(more='[[event]]\nat = 0.01\nmove = { wall = "plate", path = "path.csv" }', **still)), "path")
    largest = {}
    for name in ("sudden", "ramped"):
        early = [r["force_x"] for r in table(name, "forces.csv") if r["wall"] == "plate" and r["time"] < 0.03]
        largest[name] = max(abs(f - early[0]) for f in early)
    check(
        largest["ramped"] < 0.3 * largest["sudden"],
        f"the push of the first 20 ms: {largest['ramped']:.0f} N, without a ramp {largest['sudden']:.0f} N",
    )
    a, b = table("ramped", "history.csv")[-1], table("path", "history.csv")[-1]
    off = abs(a["moved_wall"] / b["moved_wall"] - 1)
    check(off < 2e-3, f"along a path of {n} rows: work {off:.1e} apart")
    excess, all_of_it = unaccounted("path")
    check(max(map(abs, excess)) < 1e-3 * all_of_it, f"the ledger closes: {max(map(abs, excess)) / all_of_it:.1e}")
    stop = "time.end=0.1"
    run(runs.path("path.toml"), "path legs", 2, extra=["--set", stop])
    run(runs.path("path.toml"), "path legs", extra=["--restart"])
    run(runs.path("path.toml"), "path one", extra=["--set", stop])
    run(runs.path("path.toml"), "path one", extra=["--restart"])
    check(summary("path legs")["state_hash"] == summary("path one")["state_hash"], "legs on two ranks and one: the same bits")


def tilt():
    """A tray that turns with its soil lifts it: its work is the potential that the soil gains."""
    turn = ", rotation = { center = [3.0, 0.0, 0.0], rate = 15.0 }"
    text = tray(
        end=1.8,
        cohesion=1e5,
        floor='surface = "rough"',
        more="".join(move(w, begin=0.1, end=1.1, rotation=turn) for w in ("floor", "plate", "back")),
    )
    path = scene("tilt", text)
    run(path, "tilt")
    rows, forces = table("tilt", "history.csv"), table("tilt", "forces.csv")
    turned, mass = math.radians(15), 3200.0
    # the centre of the soil, 2 m beside the axis and 0.5 m above it
    rise = 2.0 * math.sin(turned) - 0.5 * (1 - math.cos(turned))
    gained = rows[-1]["potential"] - rows[0]["potential"]
    check(abs(gained / (mass * 9.81 * rise) - 1) < 0.02, f"potential gained {gained:.0f} J, of a rigid body {mass * 9.81 * rise:.0f} J")
    gave = -rows[-1]["moved_wall"]
    check(gained < gave < 1.5 * gained, f"the tray gave {gave:.0f} J")
    excess, largest = unaccounted("tilt")
    check(max(map(abs, excess)) < 1e-3 * gave, f"the ledger closes: {max(map(abs, excess)) / gave:.1e} of that")
    late = [f for f in forces if f["time"] > 1.3]
    begin, end = late[0]["time"], late[-1]["time"]
    pushed = lambda key: sum(f[key] for f in late if f["time"] == end) - sum(f[key] for f in late if f["time"] == begin)  # noqa: E731
    mean, weight = [pushed(k) / (end - begin) for k in ("impulse_x", "impulse_z")], mass * 9.81
    check(
        abs(mean[0]) < 0.02 * weight and abs(mean[1] / weight + 1) < 0.02, f"on the walls: {mean[0]:.0f}, {mean[1]:.0f} N/m of {weight:.0f}"
    )


def earth_pressure():
    """Rankine's wedges before a smooth wall: coarse here, docs/stages.md has finer ones."""
    # at failure without dilation the middle stress is the mean of the others: sin(phi) = 3 alpha
    alpha = math.tan(math.radians(30)) / math.sqrt(9 + 12 * math.tan(math.radians(30)) ** 2)
    active = (1 - 3 * alpha) / (1 + 3 * alpha)
    weight = 1600 * 9.81 / 2
    for name, speed, end, length, expected, most in (
        ("active", -0.02, 0.8, 2.0, active, 0.12),
        ("passive", 0.1, 1.0, 3.0, 1 / active, 0.12),
    ):
        text = tray(end=end, d=0.05, length=length, more=move("plate", (speed, 0, 0), 0.05))
        run(scene(name, text), name)
        forces = [f for f in table(name, "forces.csv") if f["wall"] == "plate" and f["time"] > 0.75 * end]
        mean = -(forces[-1]["impulse_x"] - forces[0]["impulse_x"]) / (forces[-1]["time"] - forces[0]["time"])
        k = mean / weight
        check(abs(k / expected - 1) < most, f"{name}: K = {k:.3f}, Rankine's {expected:.3f}")
        excess, largest = unaccounted(name)
        check(max(map(abs, excess)) < 1e-3 * largest, f"{name}: the ledger closes: {max(map(abs, excess)) / largest:.1e}")


def gate():
    """A gate lifted at 1.5 m/s from a column: it holds while it is down, and after a while the front is that of one never there."""
    gate = """[[wall]]
name = "gate"
box = { low = [1.0, 0.0, 0.0], high = [1.4, 0.0, 1.6] }
surface = "smooth"
"""
    text = tray(length=1.0, end=1.6, floor='surface = "rough"', plate='surface = "smooth"')
    text = without(text, "back").replace("high = [1.4, 0.0, 0.0]", "high = [5.0, 0.0, 0.0]")
    run(scene("lifted", text + gate + move("gate", (0.0, 0.0, 1.5), 0.1, 1.6)), "lifted")
    run(scene("never", text), "never")
    front = lambda out, t: min(table(out, "history.csv"), key=lambda r: abs(r["time"] - t))["front_max_x"]  # noqa: E731
    check(front("lifted", 0.1) < 1.05, f"the gate holds: front at {front('lifted', 0.1):.3f} m")
    # the sand leaves below the gate's foot as it rises
    check(
        front("lifted", 0.3) < front("never", 0.2), f"0.2 s after: {front('lifted', 0.3):.3f} m, without a gate {front('never', 0.2):.3f} m"
    )
    check(abs(front("lifted", 1.6) - front("never", 1.6)) < 0.25, f"1.5 s after: {front('lifted', 1.6):.3f}, {front('never', 1.6):.3f} m")
    excess, largest = unaccounted("lifted")
    check(max(map(abs, excess)) < 2e-3 * largest, f"the ledger closes: {max(map(abs, excess)) / largest:.1e}")


def added():
    """A wall that has been moved before it is added stands where it was moved to."""
    plate = """[[wall]]
name = "late"
box = { low = [5.0, 0.0, 0.0], high = [5.4, 0.0, 1.6] }
"""
    add = '[[event]]\nat = 0.1\nadd = "late"\n'
    text = tray(end=0.15, far=5.0, more=plate + move("late", (-40.0, 0.0, 0.0), 0.0, 0.1) + add)
    done = run(scene("into", text), "into", expect=3)
    check("wall late is added" in done.stderr and "where soil stands" in done.stderr, "into soil: it is named")


def refused():
    event = lambda lines: tray(more="[[event]]\n" + lines)  # noqa: E731
    span = "from = 0.1\nto = 0.2\n"
    repeats = tray(more=move("plate", (1.0, 0.0, 0.0))).replace(
        "spacing = 0.1", 'spacing = 0.1\nlow = [-1.0, 0.0, -1.0]\nhigh = [2.4, 0.0, 3.0]\nperiodic = ["x"]'
    )
    runs.write("far.csv", "time,x,y\n0,1,0\n1,2,3\n")
    runs.refused(
        {
            "at": (event('at = 0.1\nmove = { wall = "plate", velocity = [1.0, 0.0, 0.0] }'), "a motion begins and ends"),
            "unknown wall": (
                event(span + 'move = { wall = "plat", velocity = [1.0, 0.0, 0.0] }'),
                'found "plat"; the names here: floor, plate, back',
            ),
            "no wall": (event(span + "move = { velocity = [1.0, 0.0, 0.0] }"), "event.0.move.wall"),
            "no motion": (event(span + 'move = { wall = "plate" }'), "expected a velocity, a rotation or a path"),
            "a long ramp": (event(span + 'move = { wall = "plate", velocity = [1.0, 0.0, 0.0], ramp = 0.06 }'), "at most half"),
            "no such path": (event('at = 0.1\nmove = { wall = "plate", path = "nowhere.csv" }'), "nowhere.csv"),
            "a path and a velocity": (
                event('at = 0.1\nmove = { wall = "plate", path = "far.csv", velocity = [1.0, 0.0, 0.0] }'),
                "a path alone",
            ),
            "a path that jumps": (event('at = 0.1\nmove = { wall = "plate", path = "far.csv" }'), "a first row of zeros"),
            "a path with from": (event(span + 'move = { wall = "plate", path = "far.csv" }'), "brings its own times"),
            "along y": (event(span + 'move = { wall = "plate", velocity = [0.0, 1.0, 0.0] }'), "no motion along y"),
            "about x": (
                event(span + 'move = { wall = "plate", rotation = { center = [0.0, 0.0, 0.0], axis = [1.0, 0.0, 0.0], rate = 1.0 } }'),
                "the axis y",
            ),
            "an axis without length": (
                event(span + 'move = { wall = "plate", rotation = { center = [0.0, 0.0, 0.0], axis = [0.0, 1e-170, 0.0], rate = 1.0 } }'),
                "expected a direction",
            ),
            "no rate": (event(span + 'move = { wall = "plate", rotation = { center = [0.0, 0.0, 0.0] } }'), "rotation.rate"),
            "twice": (
                tray(more=move("plate", (1.0, 0.0, 0.0), 0.1, 0.3) + move("plate", (2.0, 0.0, 0.0), 0.2, 0.4)),
                "one event at a time",
            ),
            "leap-frog": (
                tray(more=move("plate", (1.0, 0.0, 0.0)), time='[accuracy]\nscheme = "leap-frog"\ncfl = 0.2'),
                "where walls move",
            ),
            "across the period": (repeats, "along which the space repeats"),
        }
    )


if __name__ == "__main__":
    run_parts(bits, train, drawn_otherwise, work, smoothly, tilt, earth_pressure, gate, added, refused)
