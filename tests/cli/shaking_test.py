#!/usr/bin/python3
"""Ground that shakes and gravity that tilts: a block on ice, Newmark's sliding block, the critical acceleration of an infinite slope. Run as
shaking_test.py PROGRAM [PART...]."""
import math
import os
import statistics
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from harness import check
from runs import run_parts

from stages_test import block, run, scene, summary, table, unaccounted, work


def shaking():
    with open(os.path.join(work, "record.csv"), "w") as f:
        f.write("time,x\n" + "".join(f"{0.01 * k},{2 * math.sin(2 * math.pi * 2.5 * 0.01 * k)}\n" for k in range(41)))
    shaken = block(
        body='stress = "at rest"', wall='surface = "smooth"', cohesion=2e4, more='[[event]]\nat = 0.05\nshaking = "record.csv"\n', end=0.6
    )
    path = scene("shaken", shaken)
    run(path, "shaken")
    rows = table("shaken", "probes.csv")
    acceleration = [2 * math.sin(2 * math.pi * 2.5 * 0.01 * k) for k in range(41)]

    def ground(time):
        """Velocity of the ground: the integral of straight lines between the rows."""
        t, v = min(max(time - 0.05, 0), 0.4), 0.0
        for k in range(40):
            part = min(max(t - 0.01 * k, 0), 0.01)
            end = acceleration[k] + (acceleration[k + 1] - acceleration[k]) * part / 0.01
            v += 0.5 * part * (acceleration[k] + end)
        return v

    fastest = max(ground(0.01 * k) for k in range(60))
    worst = max(abs(r["velocity_x"] + ground(r["time"])) for r in rows)
    check(worst < 1e-3 * fastest, f"a block on ice stays while the ground shakes: {worst / fastest:.1e} of its speed")
    # what the shaking itself adds to the error of the ledger; the free sides' waves are in both
    calm = scene("unshaken", shaken[: shaken.index("[[event]]")])
    run(calm, "unshaken")
    (with_it, largest), (without, _) = unaccounted("shaken"), unaccounted("unshaken")
    worst = max(map(abs, with_it)) - max(map(abs, without))
    check(worst < 1e-3 * largest, f"the ledger closes while it shakes: {worst / largest:+.1e} of the largest energy")
    run(path, "shaken2", 2)
    check(summary("shaken2")["state_hash"] == summary("shaken")["state_hash"], "2 ranks: the same bits")


def newmark():
    """A block on a slope that is shaken slides downhill in jerks, as Newmark's (1965) rigid one."""
    g, beta, delta, most, frequency, cycles, n = 9.81, math.radians(10), 20.0, 4.0, 2.0, 3, 180
    last = cycles / frequency
    record = [most * math.sin(2 * math.pi * cycles * k / n) for k in range(n + 1)]
    with open(os.path.join(work, "shake.csv"), "w") as f:
        f.write("time,x\n" + "".join(f"{last * k / n!r},{a!r}\n" for k, a in enumerate(record)))
    text = block(
        gravity=f"[{g * math.sin(beta)}, 0.0, {-g * math.cos(beta)}]",
        body='stress = "at rest"',
        wall=f"surface = {{ friction_angle = {delta} }}",
        cohesion=2e5,
        more='[[event]]\nat = 0.2\nshaking = "shake.csv"\n',
        end=0.2 + last + 0.4,
    ).replace("2.0e6", "2.0e7")
    run(scene("newmark", text.replace("1.0] }", "0.5] }", 1)), "newmark")
    dt, speed, slid, limit = 1e-5, 0.0, 0.0, math.tan(math.radians(delta)) * g * math.cos(beta)
    for step in range(int((last + 0.4) / dt)):
        at = min(step * dt / last * n, n - 1e-9)
        k, part = int(at), at - int(at)
        ground = record[k] + (record[k + 1] - record[k]) * part if step * dt < last else 0.0
        drive = g * math.sin(beta) - ground
        if speed > 0 or drive > limit:  # uphill it is held: drive > -limit
            speed = max(speed + dt * (drive - limit), 0.0)
        slid += speed * dt
    rows = table("newmark", "probes.csv")
    moved = rows[-1]["x"] - [r for r in rows if r["time"] <= 0.2][-1]["x"]
    check(abs(moved / slid - 1) < 0.05, f"a shaken block slides {moved:.4f} m, Newmark's {slid:.4f} m: {100 * (moved / slid - 1):+.1f} %")


def slope():
    """An infinite slope under sideways gravity stands at 0.97 tan(phi - beta) and slides at 1.03 of it."""
    beta, phi, g, critical = math.radians(15), math.radians(30), 9.81, math.tan(math.radians(15))
    at = lambda k: f"[{g * (math.sin(beta) + k * math.cos(beta))}, 0.0, {-g * (math.cos(beta) - k * math.sin(beta))}]"  # noqa: E731
    for part in (0.97, 1.03):
        text = block(
            gravity=at(0),
            space='low = [0.0, 0.0, -1.0]\nhigh = [1.0, 0.0, 3.0]\nperiodic = ["x"]',
            effects="damping = { ratio = 0.3, until = 0.5 }",
            more=f"[[event]]\nfrom = 0.6\nto = 2.6\ngravity = {at(part * critical)}\n",
            end=5.6,
        ).replace("low = [-4.0, 0.0, -0.4], high = [8.0, 0.0, 0.0]", "low = [0.0, 0.0, -0.4], high = [1.0, 0.0, 0.0]")
        run(scene("slope", text), "slope", extra=["--force"])
        rows = table("slope", "probes.csv")
        speed = lambda begin, end: statistics.mean(r["velocity_x"] for r in rows if begin <= r["time"] <= end)  # noqa: E731
        early, late = speed(2.6, 3.1), speed(5.1, 5.6)
        stands = late < 0.5 * early
        check(
            stands == (part < 1) and (stands or late > 2 * early),
            f"at {part * critical:.4f} g, {part} of tan(phi - beta): {early:.4f} m/s, then {late:.4f} m/s",
        )


if __name__ == "__main__":
    run_parts(shaking, newmark, slope)
