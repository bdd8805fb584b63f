#!/usr/bin/python3
"""V-EXP-5: failure of a cohesive block, 4 x 2 m, plane strain: where SPH tears soil apart unless the artificial stress holds it.

rho 1850 kg/m^3, E 1.8 MPa, nu 0.3, c 5 kPa, phi 25 deg, psi 0, 50 x 100 particles 40 mm apart, 2 s; plane-strain cone, artificial
stress eps 0.5, n 2.55 (the defaults, and those of Bui et al. 2008). Smooth wall at x = 0, rough floor. The cubic spline with h 1.2 of Bui
et al., for which the criteria were first written, stands beside.
"""
import sys

import numpy as np

from common import GRAVITY, Case, changed, components, figure, neighbour_pairs, run, surface

LENGTH, HEIGHT = 4.0, 2.0  # m


def scene(eps, dx=0.04, **changes):
    base = {
        "title": f"V-EXP-5: cohesive block, eps = {eps:g}",
        "dimensions": 2,
        "space": {"spacing": dx},
        "time": {"end": 2.0},
        "soil": {
            "clay": {
                "density": 1850.0,
                "young": 1.8e6,
                "poisson": 0.3,
                "cohesion": 5000.0,
                "friction_angle": 25.0,
                "dilation_angle": 0.0,
                "cone": "plane strain",
            }
        },
        "body": [{"soil": "clay", "box": {"low": [0.0, 0.0, 0.0], "high": [LENGTH, 0.0, HEIGHT]}, "stress": "at rest"}],
        "wall": [
            {"surface": "rough", "box": {"low": [-4 * dx, 0.0, -4 * dx], "high": [10.0, 0.0, 0.0]}},
            {"surface": "smooth", "box": {"low": [-4 * dx, 0.0, 0.0], "high": [0.0, 0.0, 2.4]}},
        ],
        "effects": {"gravity": [0.0, 0.0, -GRAVITY], "viscosity": {"alpha": 0.1, "beta": 0.0}},
        "output": {"every": 0.25, "history": 0.01},
    }
    if eps > 0:
        base["effects"]["artificial_stress"] = {"epsilon": eps, "exponent": 2.55}
    return changed(base, changes)


def nearest(points, dx):
    """Distance of each particle to its nearest neighbour, in spacings; 3 where none is within three."""
    i, j = neighbour_pairs(points, 3 * dx)
    d = np.linalg.norm(points[i] - points[j], axis=1) / dx
    out = np.full(len(points), 3.0)
    np.minimum.at(out, i, d), np.minimum.at(out, j, d)
    return out


def cracks(points, dx):
    """Area of voids inside the soil, in percent of the block: places two spacings or more below the surface with no particle
    within one spacing (on a lattice the farthest place is 0.71 spacings from a particle)."""
    step = 0.5 * dx
    x = np.arange(2 * dx, points[:, 0].max(), step)
    top = surface(points[:, 0], points[:, 1], dx, x, half_width=2 * dx)
    probe = np.concatenate(
        [
            np.column_stack([np.full(n, a), (np.arange(n) + 1) * step])
            for a, n in zip(x, np.maximum(((top - 2.5 * dx) / step).astype(int), 0))
        ]
    )
    i, j = neighbour_pairs(np.concatenate([points, probe]), dx)
    covered = np.zeros(len(probe), bool)
    mixed = (i < len(points)) != (j < len(points))
    covered[np.maximum(i, j)[mixed] - len(points)] = True
    return 100 * float((~covered).sum() * step * step / (LENGTH * HEIGHT))


def shear_band(s):
    """Angle (deg) of the band of greatest plastic strain: the axis of the most sheared 3 % of the soil, weighted by strain."""
    points, strain = s["position"][:, [0, 2]], s["plastic_strain"]
    high = strain > np.quantile(strain, 0.97)
    w = strain[high]
    centred = points[high] - np.average(points[high], axis=0, weights=w)
    _, axes = np.linalg.eigh((centred * w[:, None]).T @ centred)
    return float(np.degrees(np.arctan2(abs(axes[1, 1]), abs(axes[0, 1]))))


def measure(result, dx=0.04):
    s = result.snapshot()
    points = s["position"][:, [0, 2]]
    label = components(points, 1.5 * dx)
    gap = nearest(points, dx)
    corner = int(np.argmax((s["position"] - s["displacement"]) @ np.array([1.0, 0.0, 1.0])))
    sizes = np.unique(label, return_counts=True)[1]
    return {
        "components": len(sizes),
        "largest": 100 * sizes.max() / len(points),
        "spacing": float(gap.min()),
        "clumped": 100 * float((gap < 0.6).mean()),
        "cracks": cracks(points, dx),
        "drop": -float(s["displacement"][corner, 2]),
        "front": float(result.history["front_max_x"][-1]),
        "points": points,
        "strain": s["plastic_strain"],
        "seconds": result.seconds,
        "residual": 100 * abs(float(result.history["residual"][-1])),
        "band": shear_band(result.snapshots[2]),
    }


def draw(case, with_stress, without):
    panels = []
    for title, name, m in (
        (
            f"artificial stress eps = 0.5: corner down {with_stress['drop']:.2f} m, least spacing {with_stress['spacing']:.2f}",
            "eps-0.5",
            with_stress,
        ),
        (f"without: corner down {without['drop']:.2f} m, least spacing {without['spacing']:.2f}", "eps-0", without),
    ):
        file = case.curve(f"particles-{name}", x_m=m["points"][:, 0], z_m=m["points"][:, 1], plastic_strain=m["strain"])
        panels.append(f"set title '{title}'; plot '{file}' every ::1 u 1:2:($3>2?2:$3) w p pt 7 ps 0.5 lc palette notitle")
    figure(
        "cohesive_block",
        """set multiplot layout 2,1
set size ratio -1; set xrange [1.8:5.3]; set yrange [0:2.1]; set cbrange [0:2]; set ylabel 'z (m)'; set xlabel 'x (m)'; set cblabel 'plastic shear strain'
set palette defined (0 '#30307a', 0.5 '#2a9d8f', 1 '#e9c46a', 2 '#d1495b'); set ytics 0.5
"""
        + "\n".join(panels)
        + "\nunset multiplot\n",
        size=(620, 820),
        svg=False,
    )


def record_cubic_spline(case):
    """The kernel for which the criteria were written."""
    spline = {"space.h": 1.2, "accuracy.kernel": "cubic spline"}
    m = {eps: measure(run(scene(eps, **spline), "V-EXP-5", f"cubic-spline-eps-{eps:g}")) for eps in (0.0, 0.5, 1.0)}
    for eps, old in ((0.5, "old criterion: < 0.1 %"), (0.0, "")):
        case.record(
            f"{'old criterion: ' if old else ''}cubic spline, h 1.2, eps {eps:g}: clumped soil",
            0.0,
            m[eps]["clumped"],
            "%",
            old,
            seconds=m[eps]["seconds"],
            note=f"least distance {m[eps]['spacing']:.3f} spacings, {m[eps]['components']} components, crest drop {m[eps]['drop']:.3f} m, "
            f"voids {m[eps]['cracks']:.2f} %, energy residual {m[eps]['residual']:.3f} %",
        )
    case.record(
        "old criterion: cubic spline, h 1.2, eps 1.0 instead of 0.5: change of the crest drop",
        0.0,
        100 * (m[1.0]["drop"] / m[0.5]["drop"] - 1),
        "%",
        "old criterion: < 5 %",
    )


def main(quick=False, slow=False):
    case = Case("V-EXP-5")
    if quick:
        dx = 0.08
        good, bad = (measure(run(scene(eps, dx), "V-EXP-5", f"eps-{eps:g}-coarse"), dx) for eps in (0.5, 0.0))
    else:
        dx = 0.04
        good, bad = (measure(run(scene(eps, dx), "V-EXP-5", f"eps-{eps:g}"), dx) for eps in (0.5, 0.0))
    more = {"seconds": good["seconds"], "figure": "cohesive_block.png"}
    tag = f"eps 0.5, spacing {dx * 1e3:g} mm: "
    case.record(
        tag + "connected components", 1, good["components"], "1", "= 1", good["components"] == 1, note="joined up to 1.5 spacings", **more
    )
    case.record(tag + "least distance of two particles", 1.0, good["spacing"], "spacings", "> 0.5", good["spacing"] > 0.5, **more)
    case.record(
        tag + "clumped soil (neighbour nearer than 0.6 spacings)",
        0.0,
        good["clumped"],
        "%",
        "< 0.1 %" if not quick else "< 0.5 %",
        good["clumped"] < (0.1 if not quick else 0.5),
        note=f"{bad['clumped']:.2f} % without artificial stress",
        **more,
    )
    case.record(
        tag + "voids below the surface",
        0.0,
        good["cracks"],
        "% of the block",
        note=f"{bad['cracks']:.2f} % without artificial stress",
        **more,
    )
    case.record(
        tag + "angle of the shear band at 0.5 s",
        "45 to 57.5",
        good["band"],
        "deg",
        "45 + psi/2 to 45 + phi/2",
        45 <= good["band"] <= 57.5,
        **more,
    )
    case.record(
        tag + "drop of the crest corner",
        "",
        good["drop"],
        "m",
        note=f"{bad['drop']:.3f} m without; front {good['front']:.2f} m and {bad['front']:.2f} m",
        **more,
    )
    ledger = good["residual"] <= 1.0
    case.record(
        tag + "energy ledger, residual of the potential drop",
        0.0,
        good["residual"],
        "%",
        "<= 1 %",
        None if quick else ledger,
        note=f"{bad['residual']:.3f} % without artificial stress",
        **more,
    )
    case.control(
        f"no artificial stress, spacing {dx * 1e3:g} mm: clumps or fragments",
        bad["clumped"] >= 0.5 or bad["components"] > 1,
        bad["clumped"],
        "% clumped",
        note=f"least distance {bad['spacing']:.3f} spacings, {bad['components']} components",
        seconds=bad["seconds"],
        figure="cohesive_block.png",
    )
    if not quick:
        double = measure(run(scene(1.0), "V-EXP-5", "eps-1"))
        change = 100 * (double["drop"] / good["drop"] - 1)
        case.record(
            "eps 1.0 instead of 0.5: change of the crest drop",
            0.0,
            change,
            "%",
            "< 5 %",
            abs(change) < 5,
            seconds=double["seconds"],
            note=f"energy residual {double['residual']:.1f} %",
        )
        record_cubic_spline(case)
        draw(case, good, bad)
    return case.done()


if __name__ == "__main__":
    sys.exit(main("--quick" in sys.argv, "--slow" in sys.argv))
