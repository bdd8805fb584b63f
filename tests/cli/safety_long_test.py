#!/usr/bin/python3
"""Factors of safety against published ones at two spacings (docs/verification.md): Griffiths & Lane (1999), examples 1 and 2, by associated
flow, without dilation and by Davis' bounds; undrained clay against Taylor (1937). Run as safety_long_test.py PROGRAM [--jobs N] [CASE...],
where a case is a part of a name in CASES."""
import json
import math
import os
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, program, root, scratch

sys.path.insert(0, os.path.join(root, "python"))
import kuzure

H, GRAVITY, UNIT_WEIGHT = 10.0, 9.81, 20e3  # m, m/s^2, N/m^3
PHI = 20.0  # deg; c = 0.05 gamma H in examples 1 and 2
# Name: cone, friction and dilation angle (deg), c/(gamma H), foundation (m), crest and toe (m); least and greatest factor accepted.
# Without dilation F is between cos(phi) and 1 of that of associated flow (Davis 1968), here with 1 % to either side.
ASSOCIATED = ("plane strain", PHI, PHI, 0.05)
NO_DILATION = ("plane strain, no dilation", PHI, 0.0, 0.05)
BELOW = math.cos(math.radians(PHI))
CASES = {
    "example 1, associated": (*ASSOCIATED, 0.0, (12.0, 0.0), (0.98 * 1.380, 1.02 * 1.380)),
    "example 1, no dilation": (*NO_DILATION, 0.0, (12.0, 0.0), (0.99 * BELOW * 1.380, 1.01 * 1.380)),
    "example 2, associated": (*ASSOCIATED, 0.5 * H, (20.0, 20.0), (0.97 * 1.40, 1.03 * 1.40)),
    "undrained, D = 2": ("plane strain", 0.0, 0.0, 0.25, H, (30.0, 30.0), (0.97 * 1.47, 1.03 * 1.47)),
}


def scene(cone, phi, psi, number, depth, widths, across):
    """A slope of 2:1, `across` spacings high, smooth at its sides and rough at its base."""
    dx = H / across
    crest, toe = widths
    corners = [[0.0, H], [0.0, -depth], [crest + 2 * H + toe, -depth], [crest + 2 * H + toe, 0.0], [crest + 2 * H, 0.0], [crest, H]]
    if depth == 0:
        corners = [[0.0, H], [0.0, 0.0], [crest + 2 * H, 0.0], [crest, H]]
    end = corners[2][0] + (2 * H if depth == 0 else 0)
    walls = [
        {"surface": "rough", "box": {"low": [-4 * dx, 0.0, -depth - 4 * dx], "high": [end, 0.0, -depth]}},
        {"surface": "smooth", "box": {"low": [-4 * dx, 0.0, -depth], "high": [0.0, 0.0, 1.2 * H]}},
    ]
    if depth > 0:
        walls.append({"surface": "smooth", "box": {"low": [end, 0.0, -depth - 4 * dx], "high": [end + 4 * dx, 0.0, 1.2 * H]}})
    return {
        "title": "slope",
        "dimensions": 2,
        "space": {"spacing": dx},
        "time": {"end": 1.0},
        "soil": {
            "soil": {
                "density": UNIT_WEIGHT / GRAVITY,
                "young": 2.5e7,
                "poisson": 0.3,
                "cohesion": number * UNIT_WEIGHT * H,
                "friction_angle": phi,
                "dilation_angle": psi,
                "cone": cone,
            }
        },
        "body": [{"soil": "soil", "polygon": {"points": corners}, "stress": "at rest"}],
        "wall": walls,
        "effects": {"gravity": [0.0, 0.0, -GRAVITY], "viscosity": {"alpha": 0.1}, "artificial_stress": "auto"},
    }


def main():
    words = sys.argv[2:]
    jobs = words[words.index("--jobs") + 1] if "--jobs" in words else "2"
    wanted = [w for k, w in enumerate(words) if not w.startswith("--") and (k == 0 or words[k - 1] != "--jobs")]
    work = scratch("safety-long")
    for name, (cone, phi, psi, number, depth, widths, (least, most)) in CASES.items():
        if wanted and not any(w in name for w in wanted):
            continue
        for across in (10, 20):
            out = os.path.join(work, f"{name.replace(', ', '-').replace(' ', '-')}-{across}")
            with open(out + ".toml", "w") as f:
                f.write(kuzure.to_toml(scene(cone, phi, psi, number, depth, widths, across)))
            command = [program, "safety", out + ".toml", "-o", out, "--from", "0.8", "--to", "2", "--bracket", "0.01", "--jobs", jobs]
            done = subprocess.run(command, capture_output=True, text=True)
            if not check(done.returncode == 0, f"{name}: exit {done.returncode} {done.stderr.strip()[-300:]}"):
                continue
            with open(os.path.join(out, "safety.json")) as f:
                answer = json.load(f)
            factor, seconds = answer["factor"] or math.nan, sum(t["seconds"] for t in answer["trials"])
            room = 0.01 if across == 10 else 0.0  # the coarse ones may miss the gate by so much: they show how the factor goes with dx
            check(
                (1 - room) * least <= factor <= (1 + room) * most,
                f"{name}, H/{across}: {factor:.4g} ({answer['stands']} to {answer['fails']}), gate {least:.3f} to {most:.3f}; "
                f"{len(answer['trials'])} trials, {seconds:.0f} s",
            )
    finish()


if __name__ == "__main__":
    main()
