#!/usr/bin/python3
"""V-EXP-3: run-out and height of collapsing columns against the published scaling laws, a = H0/L0 from 0.5 to 10, axisymmetric 5 (--slow: 20).

Material: glass beads of Lajeunesse et al. as published for continuum codes (rho 1925 kg/m^3, E 1.98 MPa, nu 0.23, psi 0), L0 = 0.1 m,
rough floor, K0 start, released at once. Constant friction fits collapses with the angle at which avalanches start (27.4 deg for these
beads), not with the one at which they stop (22 deg), Rousseau et al. 2023: the cone "shear", 3 alpha = tan 27.4 deg = 0.518, in both
geometries. The soils of the older criteria, the stop angle of 22.2 deg in the plane-strain cone (3 alpha = 0.369) and in the
compression cone (0.499), stand beside, against the independent code. Plane strain: half of a column that spreads to both sides
(smooth wall at x = 0), 50 spacings across L0. Axisymmetric: a whole cylinder, 10 spacings across its radius. Viscosity alpha 0.1, and
of the solver what a scene gets that asks for nothing else.

The front is where the deposit is so high by volume (2-D: columns of four spacings; axisymmetric: rings of two), which single thrown
grains do not move: 0.05 L0 in plane strain, two and a half spacings; 0.02 L0 in the axisymmetric case, where rings hold many particles.
One spacing, the older level, was a tenth and a fifth of the lowest column. history.csv's fronts, the outermost column with any grain,
stand in the notes.
"""
import sys

import numpy as np

from common import COLOURS, GRAVITY, Case, changed, figure, first_crossing, last_crossing, run, thickness

L0 = 0.1  # m
ASPECTS = {"plane": [0.5, 1, 2, 3, 5, 10], "axisymmetric": [0.5, 1, 2, 5]}
SLOW = {"plane": [20], "axisymmetric": [3, 10, 20]}
BEADS = {"density": 1925.0, "young": 1.98e6, "poisson": 0.23, "cohesion": 0.0, "dilation_angle": 0.0}
START = {"friction_angle": 27.4, "cone": "shear"}  # of avalanches
STOP = {"plane": {"friction_angle": 22.2, "cone": "plane strain"}, "axisymmetric": {"friction_angle": 22.2, "cone": "compression"}}


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
ACROSS = {"plane": 50, "axisymmetric": 10}
LEVEL = {"plane": L0 / 20, "axisymmetric": L0 / 50}  # of the front, m
# The exponent of the run-out and its tolerance. Above the break in plane strain: 0.9 in channels so wide that side walls do not count,
# as there are none here; 2/3 is that of narrow slots, whose walls hold the grains back (Balmforth & Kerswell 2005).
EXPONENT = {
    ("plane", "below"): (1.0, 0.15),
    ("plane", "above"): (0.9, 0.1),
    ("axisymmetric", "below"): (1.0, 0.15),
    ("axisymmetric", "above"): (0.5, 0.15),
}
# An independent code: explicit MPM (APIC, quadratic B-splines; axisymmetric with a hoop stress), the same hypoelastic Drucker-Prager law
# without viscosity and without memory of opened volume, a program of its own. Cells across L0: 40 to a = 1, then 20; four particles a
# cell. Fronts by volume in columns and rings of 20 mm, at the levels of LEVEL, and of one spacing for the stop angle.
MPM = "independent explicit MPM (APIC, quadratic B-splines), the same law"
MPM_RUNOUT = {
    ("plane", "start"): {0.5: 0.480, 1: 1.339, 2: 2.835, 3: 4.517, 5: 7.278, 10: 13.11},
    ("plane", "stop"): {0.5: 0.730, 1: 1.995, 2: 4.422, 5: 9.869},
    ("axisymmetric", "start"): {0.5: 0.517, 1: 1.207, 2: 2.116, 5: 4.850},
    ("axisymmetric", "stop"): {0.5: 0.310, 1: 0.801, 2: 1.577, 5: 3.011},
}


def scene(kind, a, across=None, stop=False, **changes):
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
        "space": {"spacing": dx},
        "time": {"end": 4.5 * np.sqrt(height / GRAVITY) + 4 * np.sqrt(L0 / GRAVITY)},
        "soil": {"beads": dict(BEADS, **(STOP[kind] if stop else START))},
        "body": [dict(body, soil="beads", stress="at rest")],
        "wall": wall,
        "effects": {"gravity": [0.0, 0.0, -GRAVITY], "viscosity": {"alpha": 0.1, "beta": 0.0}},
        "output": {"history": 0.005},
    }
    return changed(base, changes)


def measure(result, kind, a, across=None, level=None):
    """Run-out and height in units of L0; the front is where the deposit is `level` high (m)."""
    dx = L0 / (across or ACROSS[kind])
    level = level or LEVEL[kind]
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


def exponent(runouts):
    """Of {a: run-out}."""
    return float(np.polyfit(np.log(list(runouts)), np.log(list(runouts.values())), 1)[0])


def part_of(runouts, kind, side):
    """What of {a: run-out} is below or above the break."""
    return {a: r for a, r in runouts.items() if (a < BREAK[kind]) == (side == "below")}


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
        note=f"outermost grain {m['runout_history']:.2f}; {MPM}: {MPM_RUNOUT['plane', 'start'][2]:.2f}",
        **more,
    )
    case.record("plane, a = 2: gate on the height", "0.8 to 1.7", m["height"], "L0", "inside", 0.8 <= m["height"] <= 1.7, **more)


def control(case):
    """tan(phi) = 2, in the plane-strain cone: the soil hardly spreads, and the a = 2 gate has to see it."""
    steep = {"soil.friction_angle": 63.43, "soil.cone": "plane strain"}
    m = measure(run(scene("plane", 2, **steep), "V-EXP-3", "plane-2-mu2"), "plane", 2)
    case.control(
        "plane, a = 2, mu = 2: the a = 2 gate",
        not gate_at_2(m),
        m["runout"],
        "L0",
        note=f"height {m['height']:.2f} L0",
        seconds=m["seconds"],
    )


VARIANTS = [
    ("20 spacings across L0", "20", {}),
    ("20 spacings, viscosity alpha 0.05", "20-alpha0.05", {"effects.viscosity": {"alpha": 0.05, "beta": 0.0}}),
    ("20 spacings, viscosity alpha 0.3", "20-alpha0.3", {"effects.viscosity": {"alpha": 0.3, "beta": 0.0}}),
    ("20 spacings, E x 4", "20-E4", {"soil.young": 4 * 1.98e6}),
    ("20 spacings, cubic spline, h 1.2", "20-cubic", {"space.h": 1.2, "accuracy.kernel": "cubic spline"}),
]


def sensitivity(case, base):
    for label, name, changes in VARIANTS:
        m = measure(run(scene("plane", 2, 20, **changes), "V-EXP-3", "plane-2-" + name), "plane", 2, 20)
        case.record(
            f"sensitivity, plane, a = 2: {label}: run-out",
            round(base["runout"], 3),
            m["runout"],
            "L0",
            seconds=m["seconds"],
            note=f"height {m['height']:.2f} (base {base['height']:.2f})",
        )
        if not changes:
            base = m  # of the changes below, which are made to it
    # The higher the front is taken, the more it cuts off, and of thin deposits most.
    for across, level in ((20, 0.05), (40, 0.05), (50, 0.02)):
        name = "" if across == ACROSS["plane"] else f"-{across}"
        fine = [
            measure(run(scene("plane", a, across), "V-EXP-3", f"plane-{a:g}{name}", minutes=40), "plane", a, across, level * L0)
            for a in ASPECTS["plane"]
        ]
        for side in ("below", "above"):
            part = part_of({m["a"]: m["runout"] for m in fine}, "plane", side)
            case.record(
                f"sensitivity, plane: exponent {side} the break with {across} spacings across L0 and the front at {level} L0",
                EXPONENT["plane", side][0],
                exponent(part),
                seconds=sum(m["seconds"] for m in fine if m["a"] in part),
                note="run-out " + ", ".join(f"{r:.2f} at a = {a:g}" for a, r in part.items()),
            )


def record_exponents(case, kind, rows):
    fitted = [m for m in rows if m["a"] in ASPECTS[kind]]  # the same, whatever --slow adds
    runouts, seconds = {m["a"]: m["runout"] for m in fitted}, {m["a"]: m["seconds"] for m in fitted}
    for side in ("below", "above"):
        part = part_of(runouts, kind, side)
        power, tolerance = EXPONENT[kind, side]
        found = exponent(part)
        more = {"seconds": sum(seconds[a] for a in part), "figure": "collapsing_columns_runout.png"}
        case.record(
            f"{kind}: exponent of the run-out {side} the break",
            power,
            found,
            "1",
            f"+-{tolerance:g}",
            abs(found - power) <= tolerance,
            note="fitted to a = " + ", ".join(f"{a:g}" for a in part),
            independent=(exponent(part_of(MPM_RUNOUT[kind, "start"], kind, side)), MPM),
            **more,
        )
    if kind == "plane":
        case.record(
            "old criterion: plane: exponent of the run-out above the break, 2/3 of narrow slots",
            2 / 3,
            found,
            "1",
            "old criterion: +-0.15",
            note="there are no side walls here",
            **more,
        )


def aspect_series(case, kind, aspects):
    rows = []
    for a in aspects:
        m = measure(run(scene(kind, a), "V-EXP-3", f"{kind}-{a:g}", minutes=40), kind, a)
        rows.append(m)
        laws = {name: float(f(a)) for name, f in RUNOUT[kind].items()}
        by_mpm = MPM_RUNOUT[kind, "start"].get(a)
        case.record(
            f"{kind}, a = {a:g}: run-out",
            f"{min(laws.values()):.2f} to {max(laws.values()):.2f} (laws)",
            m["runout"],
            "L0",
            seconds=m["seconds"],
            note=(f"MPM {by_mpm:.2f}, " if by_mpm else "")
            + f"outermost grain {m['runout_history']:.2f}, height {m['height']:.2f}, kinetic energy {m['moving']:.1e} of its peak, "
            f"energy residual {m['residual']:.3f} %, {m['particles']} particles",
            figure="collapsing_columns_runout.png",
        )
    case.curve(f"{kind}", **{k: np.array([m[k] for m in rows]) for k in ("a", "runout", "runout_history", "height", "moving", "seconds")})
    for m in rows:
        case.curve(f"{kind}-profile-{m['a']:g}", x=m["at"], z=m["profile"])
    record_exponents(case, kind, rows)
    return rows


def with_the_stop_angle(case, kind):
    """The soils and spacings of the older criteria, with the front one spacing high: what a frictional continuum of that mu gives by another code."""
    across = {"plane": 20, "axisymmetric": 10}[kind]
    level, reference = L0 / across, MPM_RUNOUT[kind, "stop"]
    mu = {"plane": 0.369, "axisymmetric": 0.499}[kind]
    found = {}
    for a, by_mpm in reference.items():
        m = measure(run(scene(kind, a, across, stop=True), "V-EXP-3", f"{kind}-{a:g}-stop", minutes=40), kind, a, across, level)
        found[a] = m["runout"]
        case.record(
            f"{kind}, a = {a:g}, stop angle, mu = 3 alpha = {mu}: run-out",
            by_mpm,
            m["runout"],
            "L0",
            "+-10 %" if a == 2 else "",
            abs(m["runout"] / by_mpm - 1) <= 0.1 if a == 2 else None,
            seconds=m["seconds"],
            note=f"reference: {MPM}; height {m['height']:.2f}, front at {1e3 * level:g} mm",
        )
        if kind == "plane" and a == 2:
            case.record(
                "old criterion: plane, a = 2, stop angle: gate on the run-out",
                "2.40 to 3.60",
                m["runout"],
                "L0",
                "old criterion: inside",
                note="the beads of the experiments start to flow at 27.4 deg",
            )
    for side in ("below", "above"):
        part = part_of(found, kind, side)
        if len(part) > 1:
            case.record(
                f"old criterion: {kind}, stop angle: exponent of the run-out {side} the break",
                1.0 if side == "below" else 0.5,
                exponent(part),
                "1",
                "old criterion: +-0.15",
                note=f"MPM {exponent(part_of(reference, kind, side)):.3f}, both with the front at {1e3 * level:g} mm",
            )


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
            if laws is RUNOUT[kind]:
                mpm = MPM_RUNOUT[kind, "start"]
                file = case.curve(f"mpm-{kind}", a=np.array(list(mpm)), runout=np.array(list(mpm.values())))
                plots.append(f"'{file}' every ::1 u 1:2 w p pt 6 ps 1.4 lc rgb 'black' t 'independent MPM'")
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
    with_the_stop_angle(case, "plane")
    sensitivity(case, base)
    series["axisymmetric"] = aspect_series(case, "axisymmetric", aspects["axisymmetric"])
    with_the_stop_angle(case, "axisymmetric")
    draw(case, series)
    return case.done()


if __name__ == "__main__":
    sys.exit(main("--quick" in sys.argv, "--slow" in sys.argv))
