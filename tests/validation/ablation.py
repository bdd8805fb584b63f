#!/usr/bin/python3
"""What each effect costs and what it changes: every effect is switched on or off alone, on three small scenes.

column: aluminium bars, 4 mm (V-EXP-1); block: cohesive, 80 mm (V-EXP-5); slope: at rest at SRF 1, H/dx 20 (V-EXP-4).
Cost: shortened runs, interleaved without, with, without, with, ...; the ratio of the medians of seconds_per_step.
Change: one full run each. Effects whose keys this build refuses are skipped with a note.
"""
import hashlib
import os
import statistics
import sys

import numpy as np

import aluminium_bars
import slope_safety
import cohesive_block
from common import RESULTS, Case, RunFailed, accepted, changed, run, stress_noise, toml

COLUMN_DX, BLOCK_DX, SLOPE_DX = 0.004, 0.08, 0.5


def column(result):
    m = aluminium_bars.measure(result, 4)
    return {
        "x at 5 mm (mm)": m["toe"],
        "height at 100 mm (mm)": float(np.interp(100.0, m["at"], m["height"])),
        "stress noise": stress_noise(result.snapshots[1], COLUMN_DX, 2650.0),
    }


def block(result):
    m = cohesive_block.measure(result, BLOCK_DX)
    return {"crest drop (m)": m["drop"], "clumped (%)": m["clumped"], "stress noise": stress_noise(result.snapshot(), BLOCK_DX, 1850.0)}


def slope(result):
    m = slope_safety.measure(result)
    return {"moved since release (mm)": 1e3 * m["end"], "stress noise": stress_noise(result.snapshot(), SLOPE_DX, 2039.0)}


SCENES = {
    "column": (aluminium_bars.scene(4, **{"output.every": 0.2}), column),
    "block": (cohesive_block.scene(0.5, BLOCK_DX), block),
    "slope": (slope_safety.scene(1.0, "plane strain, no dilation", 20, **{"output.fields": None}), slope),
}

# Effect: {scene: (changes that leave it out, changes that put it in)}. Changes are relative to the scene as it stands.
NONE = {}
DIFFUSION = {"effects.stress_diffusion": {"zeta": 0.1}}
GRADIENT = {"accuracy.correction": "gradient"}
MIXED = {"accuracy.precision": "mixed"}
STRESS = {"effects.artificial_stress": {"epsilon": 0.5, "exponent": 2.55}}
NO_STRESS = {"effects.artificial_stress": None}
HOURGLASS = {"accuracy.hourglass": 0.1}
CREEPS = {"accuracy.kernel": "cubic spline", "space.h": 1.3}
EFFECTS = {
    "viscosity": {s: ({"effects.viscosity": None}, NONE) for s in SCENES},
    "artificial stress": {"column": (NONE, STRESS), "block": (NO_STRESS, NONE), "slope": (NO_STRESS, NONE)},
    "damping": {"slope": ({"effects.damping": None}, NONE)},
    "K0 start": {"column": ({"body.stress": None}, NONE), "block": ({"body.stress": None}, NONE), "slope": ({"body.stress": None}, NONE)},
    "dilation, psi 5 deg": {"column": (NONE, {"soil.dilation_angle": 5.0}), "block": (NONE, {"soil.dilation_angle": 5.0})},
    "tension cut-off, 0 Pa": {"block": (NONE, {"soil.tension_cutoff": 0.0}), "slope": (NONE, {"soil.tension_cutoff": 0.0})},
    "mixed precision": {s: (NONE, MIXED) for s in SCENES},
    "stress diffusion": {s: (NONE, DIFFUSION) for s in SCENES},
    "gradient correction": {s: (NONE, GRADIENT) for s in SCENES},
    "adjoint correction": {s: (NONE, {"accuracy.correction": "adjoint", "accuracy.cfl": 0.8}) for s in SCENES},
    "shifting, constant 2": {s: (NONE, {"accuracy.shifting": 2.0}) for s in SCENES},
    "hourglass control, 0.1": {
        "column": (NONE, HOURGLASS),
        "block": (NONE, HOURGLASS),
        "slope": (CREEPS, dict(CREEPS, **HOURGLASS)),  # with the cubic spline and h 1.3, where it is for
    },
    "kernel norm, lattice": {s: ({"accuracy.kernel_norm": "continuum"}, NONE) for s in SCENES},
    "softening": {"block": (NONE, {"soil.softening": {"cohesion": 2500.0, "friction_angle": 20.0, "slip": 0.1}})},
    "mu(I) friction": {"column": (NONE, {"soil.rate_friction": {"friction_angle": 30.0, "grain": 0.0015, "grain_density": 2700.0}})},
    "pore pressure": {"slope": (NONE, {"effects.pore_pressure": {"table": [[0.0, 4.0]]}})},
}
REPEATS = 5
TIMED_SHARE = 0.12  # of the full run


def seconds_per_step(scene, name):
    short = changed(scene, {"time.end": round(TIMED_SHARE * scene["time"]["end"], 6)})
    if "damping" in short["effects"]:
        short["effects"]["damping"] = dict(short["effects"]["damping"], until=short["time"]["end"])
    return run(short, "ablation", name, fresh=True).summary["seconds_per_step"]


def answers(scene, measure, scene_name):
    """Measurements of a full run, or why there are none. Named by its content: the scene as it stands runs once for all effects."""
    name = f"{scene_name}-{hashlib.sha256(toml(scene).encode()).hexdigest()[:8]}"
    try:
        return measure(run(scene, "ablation", name)), ""
    except RunFailed as failure:
        return {}, str(failure).splitlines()[0][:160]


def compare(case, effect, scene_name, without, having, measure):
    tag = f"{scene_name}-{effect.split(',')[0].replace(' ', '-').replace('(', '').replace(')', '')}"
    times = {"without": [], "with": []}
    for k in range(REPEATS):
        for which, scene in (("without", without), ("with", having)):
            times[which].append(seconds_per_step(scene, f"time-{tag}-{which}"))
    cost = 100 * (statistics.median(times["with"]) / statistics.median(times["without"]) - 1)
    (off, why_off), (on, why_on) = answers(without, measure, scene_name), answers(having, measure, scene_name)
    parts = [f"{k} {off.get(k, np.nan):.4g} without, {on.get(k, np.nan):.4g} with" for k in dict(off, **on)] + [
        w for w in (why_off, why_on) if w
    ]
    case.record(
        f"{effect}, {scene_name}: cost of a step", "", cost, "%", seconds=sum(times["with"]) + sum(times["without"]), note="; ".join(parts)
    )
    return {
        "effect": effect,
        "scene": scene_name,
        "cost": cost,
        "without": off,
        "with": on,
        "note": "; ".join(w for w in (why_off, why_on) if w),
    }


def table(rows, skipped):
    lines = ["| effect | scene | cost of a step | answer without -> with |", "|---|---|---|---|"]
    for r in rows:
        parts = []
        for k in dict(r["without"], **r["with"]):
            a, b = r["without"].get(k, np.nan), r["with"].get(k, np.nan)
            parts.append(f"{k} {a:.4g} -> {b:.4g}" + (f" ({100 * (b / a - 1):+.1f} %)" if a and np.isfinite(a * b) else ""))
        lines.append(f"| {r['effect']} | {r['scene']} | {r['cost']:+.0f} % | {'; '.join(parts + ([r['note']] if r['note'] else []))} |")
    lines += [f"| {effect} | | not in this build | |" for effect in skipped]
    return "\n".join(lines) + "\n"


def main(quick=False, slow=False):
    case = Case("ablation")
    rows, skipped = [], []
    for effect, scenes in EFFECTS.items():
        for scene_name, (leave_out, put_in) in scenes.items():
            base, measure = SCENES[scene_name]
            without, having = changed(base, leave_out), changed(base, put_in)
            good, why = accepted(having)
            if not good:
                case.record(
                    f"{effect}, {scene_name}", "", "skipped", "", note=why.splitlines()[-1][-160:] if why else "refused by kuzure check"
                )
                if effect not in skipped:
                    skipped.append(effect)
                continue
            if quick and (scene_name, effect) not in (("block", "artificial stress"), ("column", "mixed precision")):
                continue
            rows.append(compare(case, effect, scene_name, without, having, measure))
    with open(os.path.join(RESULTS, "ablation.md"), "w") as f:
        f.write(table(rows, skipped))
    return case.done()


if __name__ == "__main__":
    sys.exit(main("--quick" in sys.argv, "--slow" in sys.argv))
