#!/usr/bin/python3
"""V-EXP-3: run-out and height of collapsing columns against the published scaling laws, a = H0/L0 from 0.5 to 10, axisymmetric 5 (--slow: 20).

Material: glass beads of Lajeunesse et al. as published for continuum codes (rho 1925 kg/m^3, E 1.98 MPa, nu 0.23,
phi 22.2 deg, psi 0), L0 = 0.1 m, rough floor, K0 start, released at once. Plane strain: half of a column that spreads to both
sides (smooth wall at x = 0), plane-strain cone, 20 spacings across L0. Axisymmetric: a whole cylinder, compression cone,
10 spacings across its radius. Viscosity alpha 0.1; h 1.3, cubic spline, Courant 0.2 (defaults).

The front is where the deposit is one spacing high by volume (2-D: columns of four spacings; axisymmetric: rings of two),
which single thrown grains do not move; history.csv's fronts, the outermost column with any grain, stand in the notes.
"""
import sys

import numpy as np

from common import COLOURS, GRAVITY, Case, changed, figure, first_crossing, last_crossing, run, thickness

L0 = 0.1  # m
ASPECTS = {"plane": [0.5, 1, 2, 3, 5, 10], "axisymmetric": [0.5, 1, 2, 5]}
SLOW = {"plane": [20], "axisymmetric": [3, 10, 20]}
BEADS = {"density": 1925.0, "young": 1.98e6, "poisson": 0.23, "cohesion": 0.0, "friction_angle": 22.2, "dilation_angle": 0.0}


def law(below, at, above, power):
    return lambda a: np.where(np.asarray(a) < at, below * np.asarray(a, float), above * np.asarray(a, float) ** power)


RUNOUT = {
    "plane": {
        "Lube 2005, experiment": law(1.2, 2.3, 1.9, 2 / 3),
        "Lajeunesse 2005, experiment": law(1.8, 3, 2.3, 2 / 3),
        "Kumar 2015, DEM": law(1.67, 2.7, 2.7, 2 / 3),
        "Lagree 2011, mu(I) continuum": law(2.2, 7, 3.9, 0.7),
    },
    "axisymmetric": {"Lube 2004, experiment": law(1.24, 1.7, 1.6, 0.5), "Lajeunesse 2004, experiment": law(1.35, 0.74, 2.0, 0.5)},
}
HEIGHT = {
    "plane": {
        "Lajeunesse 2005, experiment": lambda a: np.where(np.asarray(a) < 0.7, a, np.asarray(a, float) ** (1 / 3)),
        "Lagree 2011, mu(I) continuum": lambda a: np.where(np.asarray(a) < 0.6, a, 0.65 * np.asarray(a, float) ** 0.35),
    },
    "axisymmetric": {
        "Lube 2004, experiment": lambda a: np.where(np.asarray(a) < 0.85, a, 0.88 * np.asarray(a, float) ** (1 / 6)),
        "Lajeunesse 2004, experiment": lambda a: np.where(np.asarray(a) < 0.74, a, 0.74),
    },
}
BREAK = {"plane": 2.5, "axisymmetric": 1.7}  # between the two power laws, as published
POWER = {"plane": 2 / 3, "axisymmetric": 0.5}
ACROSS = {"plane": 20, "axisymmetric": 10}


def scene(kind, a, across=None, **changes):
    dx = L0 / (across or ACROSS[kind])
    height = a * L0
    reach = L0 * (2 + min(3.5 * a, 5.5 * a ** (0.75 if kind == "plane" else 0.6)))  # of the floor: well beyond any published front
    reach = dx * np.ceil(reach / dx)
    if kind == "plane":
        body = {"box": {"low": [0.0, 0.0, 0.0], "high": [L0, 0.0, height]}}
        wall = [
            {"surface": "rough", "box": {"low": [-4 * dx, 0.0, -4 * dx], "high": [reach, 0.0, 0.0]}},
            {"surface": "smooth", "box": {"low": [-4 * dx, 0.0, 0.0], "high": [0.0, 0.0, height + 4 * dx]}},
        ]
    else:
        body = {"cylinder": {"base": [0.0, 0.0, 0.0], "radius": L0, "height": height}}
        wall = [{"surface": "rough", "cylinder": {"base": [0.0, 0.0, -4 * dx], "radius": reach, "height": 4 * dx}}]
    base = {
        "title": f"V-EXP-3: {kind} column, a = {a:g}",
        "dimensions": 2 if kind == "plane" else 3,
        "space": {"spacing": dx, "h": 1.3},
        "time": {"end": 4.5 * np.sqrt(height / GRAVITY) + 4 * np.sqrt(L0 / GRAVITY)},
        "soil": {"beads": dict(BEADS, cone="plane strain" if kind == "plane" else "compression")},
        "body": [dict(body, soil="beads", stress="at rest")],
        "wall": wall,
        "effects": {"gravity": [0.0, 0.0, -GRAVITY], "viscosity": {"alpha": 0.1, "beta": 0.0}},
        "accuracy": {"kernel": "cubic spline"},
        "output": {"history": 0.005},
    }
    return changed(base, changes)


def measure(result, kind, a, across=None, level=None):
    """Run-out and height in units of L0; the front is where the deposit is `level` high (default one spacing)."""
    dx = L0 / (across or ACROSS[kind])
    level = level or dx
    s = result.snapshot()
    x, y, z = s["position"].T
    at = np.arange(0.0, 1.3 * np.abs(x).max(), 0.5 * dx)
    if kind == "plane":
        profile = thickness(x, dx, np.clip(at, 2 * dx, None), 4 * dx)
    else:
        r = np.sort(np.hypot(x, y))
        at = at[at >= dx]
        rings = np.searchsorted(r, at + dx) - np.searchsorted(r, at - dx)
        profile = rings * dx**3 / (np.pi * ((at + dx) ** 2 - (at - dx) ** 2))
    front = 0.5 * (first_crossing(at, profile, level) + last_crossing(at, profile, level))  # the profile is noisy there
    history = result.history
    last = {name: column[-1] for name, column in history.items()}
    seen = (
        [last["front_max_x"]] if kind == "plane" else [-last["front_min_x"], last["front_max_x"], -last["front_min_y"], last["front_max_y"]]
    )
    return {
        "a": a,
        "runout": (front - L0) / L0,
        "runout_history": (np.mean(seen) - L0) / L0,
        "height": float(last["height"]) / L0,
        "at": at / L0,
        "profile": profile / L0,
        "moving": float(last["kinetic"] / history["kinetic"].max()),
        "seconds": result.seconds,
        "residual": 100 * abs(float(last["residual"])),
        "particles": result.summary["soil_particles"],
    }


def exponent(rows):
    a, runout = np.array([m["a"] for m in rows]), np.array([m["runout"] for m in rows])
    return float(np.polyfit(np.log(a), np.log(runout), 1)[0])


def gate_at_2(m):
    return 2.40 <= m["runout"] <= 3.60 and 0.8 <= m["height"] <= 1.7


def record_gate_at_2(case, m):
    more = {"seconds": m["seconds"], "figure": "collapsing_columns_runout.png"}
    case.record(
        "plane, a = 2: gate on the run-out",
        "2.40 to 3.60",
        m["runout"],
        "L0",
        "inside",
        2.40 <= m["runout"] <= 3.60,
        note=f"outermost grain {m['runout_history']:.2f}",
        **more,
    )
    case.record("plane, a = 2: gate on the height", "0.8 to 1.7", m["height"], "L0", "inside", 0.8 <= m["height"] <= 1.7, **more)


def control(case):
    """mu = tan(phi) = 2: the soil hardly spreads, and the a = 2 gate has to see it."""
    m = measure(run(scene("plane", 2, **{"soil.friction_angle": 63.43}), "V-EXP-3", "plane-2-mu2"), "plane", 2)
    case.control(
        "plane, a = 2, mu = 2: the a = 2 gate",
        not gate_at_2(m),
        m["runout"],
        "L0",
        note=f"height {m['height']:.2f} L0",
        seconds=m["seconds"],
    )


VARIANTS = [
    ("40 spacings across L0, front at the same 5 mm", "40", 40, {}),
    ("viscosity alpha 0.3", "alpha0.3", 20, {"effects.viscosity": {"alpha": 0.3, "beta": 0.0}}),
    ("E x 4", "E4", 20, {"soil.young": 4 * 1.98e6}),
    ("Wendland C2, h 1.5", "wc2", 20, {"space.h": 1.5, "accuracy.kernel": "wendland c2"}),
]


def sensitivity(case, base):
    for label, name, across, changes in VARIANTS:
        m = measure(run(scene("plane", 2, across, **changes), "V-EXP-3", "plane-2-" + name), "plane", 2, across, level=L0 / 20)
        case.record(
            f"sensitivity, plane, a = 2: {label}: run-out",
            round(base["runout"], 3),
            m["runout"],
            "L0",
            seconds=m["seconds"],
            note=f"height {m['height']:.2f} (base {base['height']:.2f})",
        )
    # A front one spacing high cuts the more off a deposit the thinner it is: how much of the exponent is that?
    fine = [measure(run(scene("plane", a, 40), "V-EXP-3", f"plane-{a:g}-40"), "plane", a, 40) for a in (0.5, 1, 2)]
    case.record(
        "sensitivity, plane: exponent below the break with 40 spacings across L0",
        1.0,
        exponent(fine),
        seconds=sum(m["seconds"] for m in fine),
        note="run-out " + ", ".join(f"{m['runout']:.2f} at a = {m['a']:g}" for m in fine),
    )


def aspect_series(case, kind, aspects):
    rows = []
    for a in aspects:
        m = measure(run(scene(kind, a), "V-EXP-3", f"{kind}-{a:g}", minutes=40), kind, a)
        rows.append(m)
        laws = {name: float(f(a)) for name, f in RUNOUT[kind].items()}
        case.record(
            f"{kind}, a = {a:g}: run-out",
            f"{min(laws.values()):.2f} to {max(laws.values()):.2f} (laws)",
            m["runout"],
            "L0",
            seconds=m["seconds"],
            note=f"outermost grain {m['runout_history']:.2f}, height {m['height']:.2f}, kinetic energy {m['moving']:.1e} of its peak, "
            f"energy residual {m['residual']:.3f} %, {m['particles']} particles",
            figure="collapsing_columns_runout.png",
        )
    case.curve(f"{kind}", **{k: np.array([m[k] for m in rows]) for k in ("a", "runout", "runout_history", "height", "moving", "seconds")})
    for m in rows:
        case.curve(f"{kind}-profile-{m['a']:g}", x=m["at"], z=m["profile"])
    below, above = [m for m in rows if m["a"] < BREAK[kind]], [m for m in rows if m["a"] > BREAK[kind]]
    for name, part, power in (("below", below, 1.0), ("above", above, POWER[kind])):
        e = exponent(part)
        case.record(
            f"{kind}: exponent of the run-out {name} the break",
            power,
            e,
            "1",
            "+-0.15",
            abs(e - power) <= 0.15,
            note="fitted to a = " + ", ".join(f"{m['a']:g}" for m in part),
            seconds=sum(m["seconds"] for m in part),
            figure="collapsing_columns_runout.png",
        )
    return rows


def draw(case, series):
    panels = []
    a = np.geomspace(0.4, 25, 120)
    for kind, rows in series.items():
        curves = case.curve(
            kind, **{k: np.array([m[k] for m in rows]) for k in ("a", "runout", "runout_history", "height", "moving", "seconds")}
        )
        for what, laws, column in (("run-out (front - L0)/L0", RUNOUT[kind], 2), ("height H/L0", HEIGHT[kind], 4)):
            plots = []
            for colour, (name, f) in zip(COLOURS[1:], laws.items()):
                file = case.curve(
                    f"law-{kind}-{column}-{name.split(',')[0].replace(' ', '-')}", a=a, y=np.asarray(f(a), float) * np.ones_like(a)
                )
                plots.append(f"'{file}' every ::1 u 1:2 w l lw 1.6 lc rgb '{colour}' t '{name}'")
            plots.append(f"'{curves}' every ::1 u 1:{column} w p pt 7 ps 1.1 lc rgb '{COLOURS[0]}' t 'kuzure'")
            panels.append(
                f"set title '{'plane strain' if kind == 'plane' else 'axisymmetric'}'; set ylabel '{what}'; plot " + ", ".join(plots)
            )
    rows_of_panels = len(series)
    figure(
        "collapsing_columns_runout",
        f"set multiplot layout {rows_of_panels},2\nset logscale xy; set xrange [0.4:25]; set xlabel 'aspect ratio a = H0/L0'\n"
        "set key bottom right font ',9' spacing 1\n" + "\n".join(panels) + "\nunset multiplot\n",
        size=(980, 420 * rows_of_panels),
    )


def main(quick=False, slow=False):
    case = Case("V-EXP-3")
    if quick:
        record_gate_at_2(case, measure(run(scene("plane", 2), "V-EXP-3", "plane-2"), "plane", 2))
        control(case)
        return case.done()
    aspects = {kind: sorted(ASPECTS[kind] + (SLOW[kind] if slow else [])) for kind in ASPECTS}
    series = {"plane": aspect_series(case, "plane", aspects["plane"])}
    base = next(m for m in series["plane"] if m["a"] == 2)
    record_gate_at_2(case, base)
    control(case)
    sensitivity(case, base)
    series["axisymmetric"] = aspect_series(case, "axisymmetric", aspects["axisymmetric"])
    draw(case, series)
    return case.done()


if __name__ == "__main__":
    sys.exit(main("--quick" in sys.argv, "--slow" in sys.argv))
