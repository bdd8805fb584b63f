#!/usr/bin/python3
"""V-EXP-1: collapse of a column of aluminium bars (Bui et al. 2008), 200 x 100 mm, plane strain.

Every parameter is fixed by the published set: rho 2650 kg/m^3, E 0.84 MPa, nu 0.3, c 0, phi 19.8 deg, psi 0, rough floor, smooth left
wall; of the solver: viscosity alpha 0.1 and what a scene gets that asks for nothing else. The column starts at rest (K0) and is
released all at once. The 19.8 deg are those of a shear box, whose shear stress over normal stress on a plane sheared without change of
volume is 3 alpha in every cone: the cone "shear", 3 alpha = tan 19.8 deg = 0.360. The plane-strain cone of the older criterion
(0.332) stands beside.
"""
import sys

import numpy as np

from common import COLOURS, GRAVITY, Case, changed, figure, first_crossing, last_crossing, run, surface, thickness

# Digitised experiment, mm: LandslideSIM/MaterialPointSolver.jl, MIT licence.
SURFACE = np.array(
    [
        (0, 99.2),
        (20, 99.3),
        (40, 95.9),
        (60, 89.0),
        (80, 84.4),
        (100, 77.6),
        (120, 72.2),
        (140, 66.5),
        (160, 61.6),
        (180, 53.9),
        (200, 47.4),
        (220, 42.5),
        (241, 34.8),
        (262, 30.7),
        (282, 26.5),
        (302, 21.5),
        (322, 18.9),
        (342, 13.6),
        (362, 10.9),
        (382, 7.9),
        (402, 3.7),
        (422, 2.2),
        (442, 1.5),
    ]
)
FAILURE = np.array(
    [(21.2, 98.9), (39.8, 90.1), (60.0, 80.2), (79.7, 65.2), (99.9, 54.5), (119.6, 36.8), (139.4, 25.7), (159.6, 10.4), (179.4, 0.5)]
)
TOE = 396.0  # mm, where the experiment is 5 mm high


def scene(mm, **changes):
    dx = mm * 1e-3
    base = {
        "title": f"V-EXP-1: aluminium bars, spacing {mm:g} mm",
        "dimensions": 2,
        "space": {"spacing": dx},
        "time": {"end": 0.8},  # 8 sqrt(H/g): three times the time the collapse takes
        "soil": {
            "bars": {
                "density": 2650.0,
                "young": 0.84e6,
                "poisson": 0.3,
                "cohesion": 0.0,
                "friction_angle": 19.8,
                "dilation_angle": 0.0,
                "cone": "shear",
            }
        },
        "body": [{"soil": "bars", "box": {"low": [0.0, 0.0, 0.0], "high": [0.2, 0.0, 0.1]}, "stress": "at rest"}],
        "wall": [
            {"surface": "rough", "box": {"low": [-4 * dx, 0.0, -4 * dx], "high": [0.72, 0.0, 0.0]}},
            {"surface": "smooth", "box": {"low": [-4 * dx, 0.0, 0.0], "high": [0.0, 0.0, 0.12]}},
        ],
        "effects": {"gravity": [0.0, 0.0, -GRAVITY], "viscosity": {"alpha": 0.1, "beta": 0.0}},
        "output": {"every": 0.2, "history": 0.004},
    }
    return changed(base, changes)


def boundary(start, value, limit):
    """x and z of the line left of which no particle has the value: for each row of the initial lattice, where the value
    last rises through the limit. Drawn in the initial state, which for unmoved soil is the final one too."""
    xs, zs = [], []
    rows = np.round(start[:, 1], 6)
    for z in np.unique(rows):
        row = np.nonzero(rows == z)[0]
        row = row[np.argsort(start[row, 0])]
        x, v = start[row, 0], value[row]
        still = np.nonzero(v < limit)[0]
        if len(still) == len(x) or (len(still) and still[-1] == len(x) - 1):
            continue
        k = still[-1] if len(still) else None
        xs.append(0.0 if k is None else x[k] + (limit - v[k]) / (v[k + 1] - v[k]) * (x[k + 1] - x[k]))
        zs.append(z)
    return np.array(xs), np.array(zs)


def measure(result, mm):
    """All lengths in mm. The surface is measured twice: by volume in columns of four spacings (a digitised line is a smooth one,
    and single bars on the toe do not move it), and by the highest bar within one spacing, which is what a camera sees."""
    s = result.snapshot()
    position, u = s["position"][:, [0, 2]] * 1e3, s["displacement"][:, [0, 2]] * 1e3
    at = np.arange(0.0, 560.0, 1.0)
    height = thickness(position[:, 0], mm, np.clip(at, 2 * mm, None), 4 * mm)
    top = surface(position[:, 0], position[:, 1], mm, at)
    start = position - u
    upright = np.sin(np.arctan(abs(np.polyfit(FAILURE[:, 0], FAILURE[:, 1], 1)[0])))  # from horizontal to perpendicular distance
    moved_x, moved_z = boundary(start, np.linalg.norm(u, axis=1), 1.0)
    sheared_x, sheared_z = boundary(start, s["plastic_strain"], 0.1)
    gap = (np.interp(FAILURE[:, 1], moved_z, moved_x) - FAILURE[:, 0]) * upright
    sheared_gap = (np.interp(FAILURE[:, 1], sheared_z, sheared_x) - FAILURE[:, 0]) * upright

    def error(curve):
        y = np.interp(SURFACE[:, 0], at, curve)
        return 100 * np.sqrt(np.sum((y - SURFACE[:, 1]) ** 2) / np.sum(SURFACE[:, 1] ** 2))

    history = result.history
    return {
        "at": at,
        "height": height,
        "top": top,
        "line_x": moved_x,
        "line_z": moved_z,
        "error": error(height),
        "error_top": error(top),
        "toe": 0.5 * (first_crossing(at, height, 5.0) + last_crossing(at, height, 5.0)),
        "toe_top": last_crossing(at, top, 5.0),
        "front": float(np.percentile(position[:, 0], 99.9)),
        "line": float(np.sqrt(np.mean(gap**2))),
        "line_mean": float(gap.mean()),
        "line_sheared": float(np.sqrt(np.mean(sheared_gap**2))),
        "speed": float(history["max_speed"].max()),
        "moving": float(history["kinetic"][-1] / history["kinetic"].max()),
        "residual": 100 * abs(float(history["residual"][-1])),
        "seconds": result.seconds,
    }


def record_gates(case, m, mm, gate=True, prefix=""):
    """The gates; at a spacing too coarse for them, or for information, without a verdict."""
    tag, old = f"{prefix}spacing {mm:g} mm: ", "old criterion: " if prefix else ""
    more = {"seconds": m["seconds"], "figure": "aluminium_bars_profile.png"}
    for surface_by, error, toe, note in (
        ("volume", m["error"], m["toe"], f"99.9 % of the soil within {m['front']:.0f} mm"),
        ("highest bars", m["error_top"], m["toe_top"], "single bars on the toe count in full"),
    ):
        case.record(
            tag + f"profile error P_d, surface by {surface_by}", 0.0, error, "%", old + "<= 5 %", error <= 5.0 if gate else None, **more
        )
        case.record(
            tag + f"x where the deposit is 5 mm high, surface by {surface_by}",
            TOE,
            toe,
            "mm",
            old + "+-5 %",
            abs(toe - TOE) <= 0.05 * TOE if gate else None,
            note=note,
            **more,
        )
    case.record(
        tag + "failure line (moved more than 1 mm), RMS distance",
        0.0,
        m["line"],
        "mm",
        old + "<= 5 mm",
        m["line"] <= 5.0 if gate else None,
        note=f"mean distance {m['line_mean']:+.1f} mm; plastic strain > 0.1 instead: {m['line_sheared']:.1f} mm",
        **more,
    )
    if old:
        return
    case.record(
        tag + "energy ledger, residual of the potential drop", 0.0, m["residual"], "%", "<= 1 %", m["residual"] <= 1.0, seconds=m["seconds"]
    )


SENSITIVITY = [
    ("viscosity alpha 0.05", {"effects.viscosity": {"alpha": 0.05, "beta": 0.0}}),
    ("viscosity alpha 0.2", {"effects.viscosity": {"alpha": 0.2, "beta": 0.0}}),
    ("h 1.5", {"space.h": 1.5}),
    ("cubic spline, h 1.2", {"space.h": 1.2, "accuracy.kernel": "cubic spline"}),
    ("opened volume forgotten", {"soil.opened_volume": "forgotten"}),
    ("no stress at the start", {"body.stress": None}),
    ("E x 4", {"soil.young": 4 * 0.84e6}),
    ("floor Coulomb 19.8 deg", {"wall.surface": {"friction_angle": 19.8}}),
    ("cone plane strain", {"soil.cone": "plane strain"}),
    ("cone plane strain, no dilation", {"soil.cone": "plane strain, no dilation"}),
]


def draw(case, runs):
    case.curve("experiment-surface", x_mm=SURFACE[:, 0], z_mm=SURFACE[:, 1])
    case.curve("experiment-failure", x_mm=FAILURE[:, 0], z_mm=FAILURE[:, 1])
    plots = []
    for colour, (label, name, m) in zip(COLOURS, runs):
        apart = slice(None, None, 8)  # mm: about one point for each column that the height was measured in
        profile = case.curve(f"profile-{name}", x_mm=m["at"][apart], z_mm=m["height"][apart])
        line = case.curve(f"failure-{name}", x_mm=m["line_x"], z_mm=m["line_z"])
        plots += [
            f"'{profile}' every ::1 u 1:($2>0.3?$2:1/0) w l lw 2 lc rgb '{colour}' t '{label}'",
            f"'{line}' every ::1 u 1:2 w l lw 1.6 dt 2 lc rgb '{colour}' notitle",
        ]
    prefix = case.curve("initial", x_mm=np.array([0, 200, 200]), z_mm=np.array([100, 100, 0]))
    folder = prefix[: -len("initial.csv")]
    plots += [
        f"'{prefix}' every ::1 u 1:2 w l lw 1 lc rgb '#909090' t 'before'",
        f"'{folder}experiment-surface.csv' every ::1 u 1:2 w p pt 7 ps 0.8 lc rgb 'black' t 'experiment, surface (Bui et al. 2008)'",
        f"'{folder}experiment-failure.csv' every ::1 u 1:2 w p pt 6 ps 0.9 lc rgb 'black' t 'experiment, failure line'",
    ]
    figure(
        "aluminium_bars_profile",
        """set xlabel 'x (mm)'; set ylabel 'height (mm)'; set xrange [0:500]; set yrange [0:120]; set key top right
set title 'Collapse of aluminium bars: surface (full) and failure line (dashed)'
plot """
        + ", ".join(plots),
        size=(880, 430),
    )


def main(quick=False, slow=False):
    case = Case("V-EXP-1")
    sizes = [4] if quick else [4, 2] + ([1] if slow else [])
    shown = []
    for mm in sizes:
        m = measure(run(scene(mm), "V-EXP-1", f"shear-{mm}mm", minutes=20), mm)
        record_gates(case, m, mm, gate=mm < 4)
        if quick:
            case.record(
                "spacing 4 mm: profile error P_d, as a coarse gate", 0.0, m["error"], "%", "<= 5 %", m["error"] <= 5.0, seconds=m["seconds"]
            )
        shown.append((f"cone shear, {mm:g} mm", f"shear-{mm}mm", m))
    mm = 4 if quick else 2
    m = measure(run(scene(mm, **{"soil.cone": "plane strain"}), "V-EXP-1", f"plane-strain-{mm}mm", minutes=20), mm)
    record_gates(case, m, mm, gate=False, prefix="old criterion: plane-strain cone, ")
    shown.append((f"plane-strain cone, {mm:g} mm", f"plane-strain-{mm}mm", m))
    for label, name, changes in (
        ("compression cone", "compression", {"soil.cone": "compression"}),
        ("phi 30 deg", "phi30", {"soil.friction_angle": 30.0}),
    ):
        m = measure(run(scene(mm, **changes), "V-EXP-1", f"{name}-{mm}mm"), mm)
        case.control(
            f"{label}, spacing {mm} mm: profile error P_d > 5 %",
            m["error"] > 5.0,
            m["error"],
            "%",
            seconds=m["seconds"],
            note=f"5 mm high at {m['toe']:.0f} mm, failure line {m['line']:.1f} mm off",
            figure="aluminium_bars_profile.png",
        )
        shown.append((f"{label}, {mm:g} mm", f"{name}-{mm}mm", m))
    draw(case, shown)
    if not quick:
        reference = shown[0][2]
        for label, changes in SENSITIVITY:
            m = measure(run(scene(4, **changes), "V-EXP-1", "sensitivity-" + label.replace(" ", "-").replace(",", "")), 4)
            case.record(
                f"sensitivity, spacing 4 mm: {label}: x where 5 mm high",
                round(reference["toe"], 1),
                m["toe"],
                "mm",
                seconds=m["seconds"],
                note=f"P_d {m['error']:.2f} % (base {reference['error']:.2f}), failure line {m['line']:.1f} mm (base {reference['line']:.1f}), "
                f"greatest speed {m['speed']:.2f} m/s (base {reference['speed']:.2f})",
            )
    return case.done()


if __name__ == "__main__":
    sys.exit(main("--quick" in sys.argv, "--slow" in sys.argv))
