#!/usr/bin/python3
"""Every scene of the gallery at the spacing it is written for, to its end: what its picture and its words say is what happens.
Run as gallery_long_test.py PROGRAM."""
import os
import sys
from pathlib import Path

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, root, scratch

sys.path.insert(0, os.path.join(root, "jobs"))
import gallery
import numpy as np

import kuzure
from gallery_test import SCENES, unexplained


def moved(run):
    return np.linalg.norm(run.snapshot()["displacement"], axis=1)


def soil(run, k):
    return run.snapshot()["soil"] == k


def still_in_silo(run):
    z = run.snapshot()["position"][:, 2]
    return float((z > 0.6).mean())


def behind_pier(run):
    """Thickness of the shadow against that of the sides, in grains, at the time of its picture."""
    x, y, _ = run.snapshot(0.5)["position"].T
    strip = (x > 3.1) & (x < 3.5)
    return float((strip & (abs(y) < 0.24)).sum() / max(1, (strip & (abs(y) > 0.4)).sum()))


def wedge(run):
    """Of the gravity wall: its way, and the sand's that moved more than half as far, as an angle at the wall's heel (deg)."""
    s, way = run.snapshot(), moved(run)
    start = s["position"] - s["displacement"]
    wall = np.median(way[soil(run, 1)])
    sand = soil(run, 0) & (way > 0.5 * wall) & (start[:, 2] > 2.8)
    return wall, np.degrees(np.arctan2(3.0, 6.0 - start[sand, 0].min()))


def pushed(run, wall, begin, end):
    """Mean force on a named wall along x, N/m."""
    forces = run.table("forces")
    of_wall = forces["wall"] == wall
    time, impulse = np.asarray(forces["time"])[of_wall], np.asarray(forces["impulse_x"])[of_wall]
    a, b = (int(abs(time - t).argmin()) for t in (begin, end))
    return (impulse[b] - impulse[a]) / (time[b] - time[a])


def earth_pressure(run, begin, end):
    """K: the force on the plate over rho g H^2/2."""
    return -pushed(run, "plate", begin, end) / (1600 * 9.81 / 2)


def front(run, t):
    history = run.history
    return float(np.interp(t, history["time"], history["front_max_x"]))


def furthest(run, t):
    return float(np.linalg.norm(run.snapshot(t)["displacement"], axis=1).max())


def surface(run, t, low, high):
    """The top of the soil between these x, m."""
    x, _, z = run.snapshot(t)["position"].T
    return float(z[(x > low) & (x < high)].max())


def sinks(run, begin, end):
    """Speed of the footing's plate, m/s."""
    plate = run.table("probes")
    return float(-np.subtract(*np.interp((end, begin), plate["time"], plate["z"])) / (end - begin))


# What each must show, with the bounds within which it does.
OUTCOMES = {
    "bank": lambda r: [("the front, m", r.history["front_max_x"].max(), 5.5, 7.0)],
    "slope": lambda r: [
        ("the toe's way, m", r.history["front_max_x"].max() - 32, 1.0, 8.0),
        ("of the crest's back, m", np.median(moved(r)), 0.0, 4.0),
    ],
    "layered_slope": lambda r: [
        ("the sand's way, m", moved(r)[soil(r, 0)].max(), 1.0, 8.0),
        ("the base's, m", np.median(moved(r)[soil(r, 2)]), 0, 0.1),
    ],
    "sensitive_clay": lambda r: [("the scar's edge, m", r.surface().at[r.surface().height > 4.5].max(), 4.0, 18.0)],
    "aluminium_bars": lambda r: [("the toe, m", r.surface().runout + 0.2, 0.36, 0.46)],
    "column": lambda r: [("run-out over half the width", r.surface().runout / 0.16, 6.0, 11.0)],
    "cylinder": lambda r: [("run-out over the radius", r.surface().runout / 0.1, 0.5, 1.5)],
    "silo": lambda r: [
        ("what stays above the slot", still_in_silo(r), 0.2, 0.8),
        ("speed at the end, m/s", np.median(r.history["max_speed"].tail(5)), 0, 0.8),
    ],
    "pier": lambda r: [("the pier's shadow", behind_pier(r), 0.0, 0.1)],
    "gravity_wall": lambda r: [("the wall's way, m", wedge(r)[0], 0.1, 0.8), ("the wedge, deg", wedge(r)[1], 40, 52)],
    "chute": lambda r: [("at its foot", float((r.snapshot()["position"][:, 0] > 1.5).mean()), 0.6, 1.0)],
    "embankment": lambda r: [
        ("its top sinks, m", 3.9 - r.snapshot()["position"][soil(r, 0), 2].max(), 0.5, 3.5),
        ("the ground heaves, m", r.snapshot()["position"][soil(r, 1), 2].max(), 0.2, 2.0),
    ],
    "gate": lambda r: [
        ("the front while the gate is down, m", front(r, 0.2), 0.99, 1.01),
        ("the gate bears, N/m", pushed(r, "gate", 0.0, 0.2), 3400, 4000),
        ("the front at the end, m", front(r, 2.0), 2.2, 2.7),
        ("speed at the end, m/s", r.history["max_speed"].iloc[-1], 0.0, 0.3),
    ],
    "excavation": lambda r: [
        *[
            (f"{lifts} lifts: the wall bears, kN/m", 1e-3 * pushed(r, "wall", *when), *bounds)
            for lifts, when, bounds in (
                (0, (0.5, 1.0), (65, 80)),
                (1, (2.0, 2.5), (185, 205)),
                (2, (3.5, 4.0), (270, 300)),
                (3, (5.5, 6.0), (370, 415)),
            )
        ],
        ("two lifts: the bottom heaves, m", surface(r, 4.0, 9.6, 15.0) - 4.9, 0.0, 0.03),
        ("three: it heaves, m", surface(r, 6.0, 9.6, 15.0) - 3.5, 0.1, 0.3),
        ("the ground behind sinks, m", 7.9 - surface(r, 6.0, 4.0, 7.0), 0.05, 0.3),
    ],
    "rain": lambda r: [
        ("before the rain it moves, m", furthest(r, 3.0), 0.0, 0.005),
        ("the slide's way, m", furthest(r, 12.0), 2.5, 5.0),
        ("speed at the end, m/s", r.history["max_speed"].iloc[-1], 0.0, 0.2),
    ],
    # the last third of the motion
    "active_wall": lambda r: [("K", earth_pressure(r, 1.2, 1.7), 0.34, 0.385)],
    "passive_wall": lambda r: [("K", earth_pressure(r, 1.8, 2.6), 2.75, 3.2)],
    "footing": lambda r: [("sinks at 4.8 c, m/s", sinks(r, 5.0, 6.0), 0, 0.002), ("at 5.7 c, m/s", sinks(r, 7.0, 8.5), 0.02, 0.06)],
    "hirata_52": lambda r: [("height over the edge", r.history["height"].iloc[-1] / 2.08, 0.3, 0.7)],
}


def main():
    work = Path(scratch("gallery"))
    check(set(OUTCOMES) == set(gallery.SCENES), "every picture has words that are measured")
    for name, (_, sets) in gallery.SCENES.items():
        run = kuzure.run(SCENES / f"{name}.toml", work / name, **sets)
        s = run.summary
        text = (SCENES / f"{name}.toml").read_text()
        check(
            abs(s["energy"]["residual"]) < 0.01, f"{name}: residual {s['energy']['residual']:.1e}, {s['wall_seconds']:.1f} s of wall time"
        )
        check(not unexplained(name, text, s["warnings"]), f"{name}: {s['warnings']}")
        for what, value, low, high in OUTCOMES[name](run):
            check(low <= value <= high, f"{name}: {what} {value:.3g}, expected {low:g} to {high:g}")
    finish()


if __name__ == "__main__":
    main()
