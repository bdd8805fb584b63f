#!/usr/bin/python3
"""Loads on free faces: what they push is pressure times area, whatever way the soil is drawn; the same bits on any ranks, threads and
restarts; a column that settles by the oedometer's modulus; pressure from all sides; forces on walls, momentum and ledger; ramps, events;
exit 2 for what no load can do. Run as loads_test.py PROGRAM [PART...]."""
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
import h5py
from harness import check, scratch, vector
from runs import Runs, run_parts

runs = Runs(scratch("loads"))
scene, run, summary, raw, table, unaccounted = runs.scene, runs.run, runs.summary, runs.raw, runs.table, runs.unaccounted

D, YOUNG, POISSON, DENSITY = 0.1, 2.0e7, 0.25, 1800.0
SOIL = f"""[soil.clay]
density = {DENSITY}
young = {YOUNG}
poisson = {POISSON}
cohesion = 4.0e5
friction_angle = 20.0
"""
G = "gravity = [0.0, 0.0, -9.81]\n"


def body(low, high, more=""):
    return f'[[body]]\nsoil = "clay"\nbox = {{ low = {vector(low)}, high = {vector(high)} }}\n{more}'


def wall(low, high, more='surface = "smooth"'):
    return f"[[wall]]\nbox = {{ low = {vector(low)}, high = {vector(high)} }}\n{more}\n"


def load(what, low=None, high=None, more=""):
    box = f"box = {{ low = {vector(low)}, high = {vector(high)} }}\n" if low else ""
    return f"[[load]]\n{what}\n{box}{more}\n"


def text(parts, end=0.1, dimensions=2, effects=G, history=0.01, time="", soil=SOIL):
    return f"""title = "soil under load"
dimensions = {dimensions}
[space]
spacing = {D}
[time]
end = {end}
{time}
{soil}
{''.join(parts)}
[effects]
{effects}viscosity = {{ alpha = 0.1 }}
[output]
history = {history}
"""


def force(out, k=0):
    return summary(out)["loads"][k]["force"]


# A column between smooth walls, 1 m wide and 2 m high.
H = 2.0
COLUMN = [
    body((0, 0, 0), (1, 0, H), 'name = "column"\nstress = "at rest"\n'),
    wall((-0.4, 0, -0.4), (1.4, 0, 0), 'surface = "smooth"\nname = "floor"'),
    wall((-0.4, 0, 0), (0, 0, H + 1)),
    wall((1, 0, 0), (1.4, 0, H + 1)),
]
TOP = ((-1, 0, H - 3 * D), (2, 0, H + 0.5))


def oedometer():
    """A load that grows on a column: how far it sinks, what the floor bears, the ledger."""
    q = 2.0e4
    ramp = '[[event]]\nfrom = 0.05\nto = 0.55\nload = { name = "fill", factor = 1.0 }\n'
    lost = 0.1  # of the area of faces without a normal: soil in the corners with the walls has fewer neighbours
    for kind, most in (("normal = [0.0, 0.0, 1.0]", 1e-9), ("", lost), ("follow = true", lost)):
        top = load(f"pressure = {q}", *TOP, f'name = "fill"\nfactor = 0.0\n{kind}')
        damped = "damping = { ratio = 0.5, until = 9.0 }\n"
        run(scene("column", text([*COLUMN, top, ramp], end=1.0, effects=G + damped)), "column", extra=["--force"])
        modulus = YOUNG * (1 - POISSON) / ((1 + POISSON) * (1 - 2 * POISSON))
        rows, forces, named = table("column", "history.csv"), table("column", "forces.csv"), kind or "dead"
        pushed = force("column")
        check(math.dist(pushed, (0, 0, -q)) < most * q, f"{named}: pressure times area is {q:.0f} N a metre down: {pushed}")
        # the work of a force that grows linearly over a way w is q w/2
        sunk = 2 * rows[-1]["loads"] / pushed[2]
        check(0 < sunk / (q * H / modulus) - 1 < 0.25, f"{named}: sinks by q H/M = {q * H / modulus:.5f} m: {sunk:.5f} m")
        weight = DENSITY * 9.81 * H
        mean = (forces[-1]["impulse_z"] - forces[-21]["impulse_z"]) / (forces[-1]["time"] - forces[-21]["time"])
        bears = weight - (pushed[2] if "follow" not in kind else -q * (1 - lost / 2))
        within = 1e-3 if "follow" not in kind else lost / 2
        check(abs(-mean / bears - 1) < within, f"{named}: the floor bears weight and load, {bears:.0f} N: {-mean:.1f} N")
        off, largest = unaccounted("column")
        check(max(map(abs, off)) < 1e-3 * largest, f"{named}: ledger: {max(map(abs, off)) / largest:.1e}")


def at_rest():
    """Soil "at rest" under a load that is there from the start has settled under it."""
    q = 2.0e4
    run(scene("rest", text([*COLUMN, load(f"pressure = {q}", *TOP, "normal = [0.0, 0.0, 1.0]")], end=0.1)), "rest")
    forces = table("rest", "forces.csv")
    mean = (forces[-1]["impulse_z"] - forces[0]["impulse_z"]) / 0.1
    check(abs(-mean / (DENSITY * 9.81 * H + q) - 1) < 5e-3, f"the floor bears weight and load from the start: {-mean:.0f} N")
    speed = table("rest", "history.csv")[-1]["max_speed"]
    check(speed < 2e-3, f"and the soil stays at rest: {speed:.1e} m/s")
    check("a load acts" in summary("rest")["settling"]["why"], "it says why it settled")


def all_round():
    """Pressure from all sides on a body that floats: no momentum, the right volume, nothing where it is shifted, turned, cut."""
    p = 1.0e4
    follow = "follow = true"
    for dimensions in (2, 3):
        high = (1, 0 if dimensions == 2 else 0.6, 0.8)
        block = body((0, 0, 0), high, 'name = "block"\n')
        float_ = lambda parts: text(
            parts, end=0.3, dimensions=dimensions, effects="damping = { ratio = 1.0, until = 9.0 }\n", time="step = 1.0e-4"
        ).replace("spacing = 0.1", "spacing = 0.1\nh = 1.5")
        done = run(scene("block", float_([block, load(f"pressure = {p}", more=follow)])), "block", extra=["--force"])
        check("nothing will move" not in done.stderr, f"{dimensions}-D: no word that nothing will move without gravity")
        measured = force("block")
        check(math.dist(measured, (0, 0, 0)) < 1e-9 * p, f"{dimensions}-D: no net force: {measured}")
        rows = table("block", "history.csv")
        # p V (p/K)/2 of elastic energy; in 2-D plane strain p^2 (1 + nu)(1 - 2 nu)/E
        volume = math.prod(high) if dimensions == 3 else high[0] * high[2]
        energy = volume * p * p / 2 * (3 if dimensions == 3 else 2 * (1 + POISSON)) * (1 - 2 * POISSON) / YOUNG
        check(abs(rows[-1]["elastic"] / energy - 1) < 0.03, f"{dimensions}-D: elastic energy {energy:.3f} J: {rows[-1]['elastic']:.3f} J")
        off, largest = unaccounted("block")
        check(max(map(abs, off)) < 1e-3 * largest, f"{dimensions}-D: ledger: {max(map(abs, off)) / largest:.1e}")
        # as two loads that meet, as the body's own, and far away
        halves = [
            load(f"pressure = {p}", (-1, -1, -1), (0.5, 2, 2), follow),
            load(f"pressure = {p}", (0.5 + 1e-6, -1, -1), (2, 2, 2), follow),
        ]
        run(scene("cut", float_([block, *halves])), "cut", extra=["--force"])
        check(table("cut", "history.csv") == rows, f"{dimensions}-D: two loads that meet are one")
        run(scene("own", float_([block, load(f"pressure = {p}", more=follow + '\nbody = "block"')])), "own", extra=["--force"])
        check(
            summary("own")["state_hash"] == summary("block")["state_hash"], f"{dimensions}-D: a load of the body alone is that of all soil"
        )
        shift = (320.0, 0, -64.0)
        moved = body([a for a in shift], [a + b for a, b in zip(shift, high)])
        run(scene("far", float_([moved, load(f"pressure = {p}", more=follow)])), "far", extra=["--force"])
        away = abs(table("far", "history.csv")[-1]["elastic"] / rows[-1]["elastic"] - 1)
        check(away < 1e-9, f"{dimensions}-D: far away: elastic energy {away:.1e} apart")


def turned():
    """A strip of pressure on the top, on the side, from below, in the mirror: the same."""
    p, found = 3.0e4, {}
    ways = {"top": lambda x, z: (x, z), "side": lambda x, z: (z, x), "bottom": lambda x, z: (x, -z), "mirror": lambda x, z: (-x, z)}
    for kind in ("", "follow = true"):
        for way, at in ways.items():
            place = lambda low, high: tuple(
                tuple(f(a, b) for a, b in zip((p0[0], 0, p0[1]), (p1[0], 0, p1[1])))
                for f in (min, max)
                for p0, p1 in [(at(low[0], low[2]), at(high[0], high[2]))]
            )
            parts = [
                body(*place((0, 0, 0), (1.2, 0, 0.8))),
                wall(*place((-0.4, 0, -0.4), (1.6, 0, 0)), 'surface = "rough"'),
                load(f"pressure = {p}", *place((0.25, 0, 0.5), (0.65, 0, 1.0)), kind),
            ]
            run(scene(way, text(parts, end=0.05, effects="", time="step = 2.0e-4")), way, extra=["--force"])
            found[way] = table(way, "history.csv")[-1], force(way)
        top, pushed = found["top"]
        check(abs(math.hypot(*pushed) / (p * 0.5) - 1) < 1e-9, f"{kind or 'dead'}: five columns of 0.1 m: {pushed}")
        for way in ("side", "bottom", "mirror"):
            row = found[way][0]
            off = max(abs(row[k] / top[k] - 1) for k in ("kinetic", "elastic", "loads"))
            check(off < 1e-9, f"{kind or 'dead'}: {way}: energies {off:.1e} apart")


def traction():
    """A traction along the top of a block on ice: m a = t A, and the momentum is the impulse."""
    t, m = 5.0e3, DENSITY * 1.0 * 0.5
    for dimensions in (2, 3):
        wide = 0.5 if dimensions == 3 else 1.0
        high = (1, 0 if dimensions == 2 else wide, 0.5)
        parts = [
            body((0, 0, 0), high, 'stress = "at rest"\n'),
            wall((-1, -1, -0.4), (2, 2, 0)),
            load(f"traction = [{t}, 0.0, 0.0]", (-1, -1, 0.25), (2, 2, 1), "normal = [0.0, 0.0, 2.0]\nfactor = 0.0\nname = 'wind'"),
            '[[event]]\nfrom = 0.02\nto = 0.12\nload = { name = "wind", factor = 2.0 }\n',
            '[[event]]\nat = 0.2\nremove = "wind"\n',
            "[[probe]]\nbody = 'block'\n",
        ]
        parts[0] += 'name = "block"\n'
        path = scene("wind", text(parts, end=0.25, dimensions=dimensions))
        run(path, "wind", extra=["--force", "--set", "time.end=0.15"])
        pushed = force("wind")
        run(path, "wind", extra=["--restart"])
        rows = table("wind", "probes.csv")
        # at the edges along the top half of a side face counts too where it looks up; there is none
        check(math.dist(pushed, (t * wide, 0, 0)) < 4e-3 * t * wide, f"{dimensions}-D: t A = {t * wide:.0f} N along x: {pushed}")
        impulse = pushed[0] * 2 * (0.1 / 2 + 0.08)
        speed = rows[-1]["velocity_x"]
        check(abs(speed * m * wide / impulse - 1) < 2e-3, f"{dimensions}-D: momentum {speed * m * wide:.2f} of {impulse:.2f} N s")
        check(summary("wind")["loads"][0]["factor"] == 0, "nothing of it acts after it has gone")
        still = abs(rows[-1]["velocity_x"] - rows[-5]["velocity_x"]) / speed
        check(still < 1e-6, f"{dimensions}-D: and the speed stays: {still:.1e}")


def plate():
    """A strip of load on a wide body sinks as one under a plate, and bends without one; the floor bears the same."""
    q, wide = 4.0e4, 3.0
    strip = (-1, 0, 1 - 3 * D), (0.8 + D / 10, 0, 2)
    sunk = {}
    for way, sign in (("plate", 1), ("mirrored", -1), ("bare", 1)):
        mirrored = lambda low, high: sorted((sign * low, sign * high))  # noqa: E731
        x, s = mirrored(0, wide), mirrored(strip[0][0], strip[1][0])
        parts = [
            body((x[0], 0, 0), (x[1], 0, 1), 'stress = "at rest"\n'),
            wall((x[0] - 0.4, 0, -0.4), (x[1] + 0.4, 0, 0), 'surface = "rough"\nname = "floor"'),
            wall((-0.4, 0, 0), (0, 0, 2)) if sign > 0 else wall((0, 0, 0), (0.4, 0, 2)),
            load(
                f"pressure = {q}",
                (s[0], 0, strip[0][2]),
                (s[1], 0, 2),
                f'normal = [0.0, 0.0, 1.0]\nname = "footing"\nfactor = 0.0\nplate = {"false" if way == "bare" else "true"}',
            ),
            '[[event]]\nfrom = 0.02\nto = 0.22\nload = { name = "footing", factor = 1.0 }\n',
        ]
        path = scene(way, text(parts, end=0.5, effects=G + "damping = { ratio = 0.5, until = 9.0 }\n", time="step = 4.0e-4"))
        run(path, way)
        with h5py.File(runs.path(way, "checkpoint.h5")) as f:
            p = f["particles"]
            under = (p["load"][:] == 1) & (abs(p["load_push"][:]).max(axis=1) > 0.5 * q * D)
            sunk[way] = (p["origin"][:] - p["position"][:])[under][:, 2]
        pushed = force(way)
        check(len(sunk[way]) == 8 and math.dist(pushed, (0, 0, -0.8 * q)) < 1e-6 * q, f"{way}: eight columns, {pushed}")
        off, largest = unaccounted(way)
        check(max(map(abs, off)) < 1e-3 * largest, f"{way}: ledger: {max(map(abs, off)) / largest:.1e}")
        forces = [r for r in table(way, "forces.csv") if r["time"] > 0.4]
        mean = (forces[-1]["impulse_z"] - forces[0]["impulse_z"]) / (forces[-1]["time"] - forces[0]["time"])
        bears = DENSITY * 9.81 * wide + 0.8 * q
        check(abs(-mean / bears - 1) < 1e-3, f"{way}: the floor bears {bears:.0f} N: {-mean:.1f} N")
    level, bent = (max(sunk[w]) - min(sunk[w]) for w in ("plate", "bare"))
    check(
        level < 1e-12 and bent > 1e-4,
        f"under the plate all sink by {max(sunk['plate']):.5f} m ({level:.0e} apart), without by {bent:.1e} m more or less",
    )
    check(0.8 < max(sunk["plate"]) / (sum(sunk["bare"]) / 8) < 1.05, "as deep as the mean without one, or a little less")
    apart = abs(max(sunk["plate"]) / max(sunk["mirrored"]) - 1)
    check(apart < 1e-9, f"in the mirror: {apart:.1e}")
    for ranks, threads in ((1, 2), (4, 1)):
        run(runs.path("plate.toml"), "plate again", ranks, threads, ["--force", "--recut-every", "2"])
        check(summary("plate again")["state_hash"] == summary("plate")["state_hash"], f"{ranks} x {threads}: the same bits")


BITS = [
    body((0, 0, 0), (2, 0, 1), 'name = "bank"\nstress = "at rest"\n'),
    wall((-0.4, 0, -0.4), (3.4, 0, 0), 'surface = { friction_angle = 20.0 }\nname = "floor"'),
    wall((-0.4, 0, 0), (0, 0, 2), 'name = "back"\nsurface = "smooth"'),
    load("pressure = 2.0e4", (0, 0, 0.7), (0.8, 0, 1.2), 'name = "footing"\nfactor = 0.3'),
    load("pressure = 1.0e4", (1.7, 0, 0), (2.5, 0, 0.65), 'name = "water"\nfollow = true'),
    load("traction = [0.0, 0.0, -5.0e3]", (1.05, 0, 0.6), (1.6, 0, 1.4), 'name = "truck"\nnormal = [0.0, 0.0, 1.0]'),
    '[[event]]\nfrom = 0.03\nto = 0.12\nload = { name = "footing", factor = 2.0 }\n',
    '[[event]]\nat = 0.1\nadd = "truck"\nremove = "water"\n',
]
WEAK = SOIL.replace("4.0e5", "2.0e3")


def bits():
    """Three loads that come, grow and go on soil that flows."""
    path = scene("bits", text(BITS, end=0.2, soil=WEAK, time="retry = true\n"))
    run(path, "one")
    one = summary("one")
    check(one["energy"]["loads"] < -1, f"loads gave {-one['energy']['loads']:.1f} J")
    for ranks, threads in ((1, 2), (2, 1), (4, 1), (7, 1)):
        other = f"{ranks}x{threads}"
        run(path, other, ranks, threads, ["--recut-every", "3"])
        check(summary(other)["state_hash"] == one["state_hash"], f"{other}: the bits of 1 x 1")
        check(summary(other)["loads"] == one["loads"], f"{other}: the same loads")
        for name in ("history.csv", "forces.csv", "events.csv"):
            check(raw(other, name) == raw("one", name), f"{other}: the same {name}")
    run(path, "legs", extra=["--set", "time.end=0.03"])
    run(path, "legs", 2, extra=["--restart", "--set", "time.end=0.1"])
    run(path, "legs", extra=["--restart"])
    check(summary("legs")["state_hash"] == one["state_hash"], "three legs: the bits of one run")
    ends = runs.in_legs(path, "stopped", one["wall_seconds"])
    check(ends[-1]["state_hash"] == one["state_hash"] and len(ends) > 1, f"taken up {len(ends) - 1} times: the bits of one run")
    off, largest = unaccounted("one")
    check(max(map(abs, off)) < 3e-3 * largest, f"ledger: {max(map(abs, off)) / largest:.1e}")
    page = runs.read("one", "report.html")
    for words in ("load truck is added", "Force on wall floor", "footing", "<h2>Events, loads, forces on walls"):
        check(words in page, f"the report says: {words}")


def refused():
    """What no load can do."""
    with_ = lambda more, parts=COLUMN, **how: text([*parts, more], **how)
    good = load("pressure = 2.0e4", *TOP, 'name = "fill"')
    runs.refused(
        {
            "nothing": (with_(load("")), "pressure or traction"),
            "both": (with_(load("pressure = 1.0\ntraction = [1.0, 0.0, 0.0]", more="normal = [0.0, 0.0, 1.0]")), "found both"),
            "no normal": (with_(load("traction = [1.0, 0.0, 0.0]")), "normal"),
            "a normal of no length": (with_(load("pressure = 1.0", more="normal = [0.0, 0.0, 0.0]")), "direction"),
            "a normal of hardly any": (with_(load("pressure = 1.0", more="normal = [0.0, 0.0, 1e-170]")), "direction"),
            "follow along a normal": (with_(load("pressure = 1.0", more="follow = true\nnormal = [0.0, 0.0, 1.0]")), "follow"),
            "negative": (with_(load("pressure = -1.0")), "load.0.pressure"),
            "no body": (with_(load("pressure = 1.0", more='body = "nobody"')), "nobody"),
            "a box inside out": (with_(load("pressure = 1.0", (1, 0, 1), (0, 0, 2))), "low below high"),
            "no soil": (with_(load("pressure = 1.0", (0, 0, 5), (1, 0, 6))), "expected soil"),
            "two on one": (with_(good + load("pressure = 1.0")), "no other load"),
            "a plate without a normal": (with_(load("pressure = 1.0", more="plate = true")), "expected a normal with a plate"),
            "a plate on sleepers": (
                with_(load("pressure = 1.0", more="plate = true\nnormal = [0.0, 0.0, 1.0]") + "[accuracy]\nsleep_below = 0.001\n"),
                "sleep",
            ),
            "along y": (with_(load("traction = [0.0, 1.0, 0.0]", more="normal = [0.0, 0.0, 1.0]")), "two dimensions"),
            "names": (with_(good.replace("fill", "floor")), "no other wall, body or load"),
            "unknown": (with_(good + '[[event]]\nat = 0.05\nload = { name = "hill", factor = 1.0 }\n'), "hill"),
            "factor": (with_(good + '[[event]]\nat = 0.05\nload = { name = "fill", factor = -1.0 }\n'), "factor"),
            "leap-frog": (with_(good + '[accuracy]\nscheme = "leap-frog"\n'), "staggered"),
        }
    )
    # two stones so far apart that no grid of samples holds both
    far = [body((x, x, 0), (x + 1, x + 1, 1)) for x in (0, 1.2e3)]
    wide = text([*far, load("pressure = 1.0", more="normal = [0.0, 0.0, 1.0]")], dimensions=3)
    for ranks in (1, 2):
        done = run(scene("far", wide), "far", ranks, expect=3, extra=["--force"])
        check("seen along its normal" in done.stderr and "Remedy" in done.stderr, f"far apart, {ranks} ranks: {done.stderr.strip()[-150:]}")
    # found as it begins: where the soil is by then
    late = '[[event]]\nat = 0.05\nadd = "fill"\n'
    for what, more in (
        ("no soil", good.replace(str(H - 3 * D), "5.0").replace(str(H + 0.5), "6.0")),
        ("on soil", good + load("pressure = 1.0")),
    ):
        done = run(scene("late", with_(more + late)), "late", expect=3, extra=["--force"])
        check(what in done.stderr and "Remedy" in done.stderr, f"{what}: {done.stderr.strip()[-200:]}")


if __name__ == "__main__":
    run_parts(oedometer, at_rest, all_round, turned, traction, plate, bits, refused)
