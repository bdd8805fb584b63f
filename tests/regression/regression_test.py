#!/usr/bin/python3
"""Four small scenes against what they gave before: regression_test.py PROGRAM [--update].

reference.json keeps the state_hash and the energies of history.csv: one set of bits for every instruction set.

--update stores what the program gives now. A change of bits comes in a commit of its own that says why they change."""
import csv
import json
import os
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, program, scratch

here = os.path.dirname(os.path.abspath(__file__))
stored = os.path.join(here, "reference.json")
ENERGIES = ("kinetic", "potential", "elastic", "plastic", "viscous", "wall", "damping")


def results(work, name, *more):
    """What one scene gives: its hash and the energies at each row of its history."""
    out = os.path.join(work, name)
    subprocess.run([program, "run", os.path.join(here, name + ".toml"), "-o", out, "--quiet", "--force", *more], check=True, timeout=300)
    with open(os.path.join(out, "summary.json")) as f:
        summary = json.load(f)
    with open(os.path.join(out, "history.csv")) as f:
        rows = [r for r in csv.DictReader(f) if not r["time"].startswith("#")]
    return {
        "state_hash": summary["state_hash"],
        "steps": summary["steps"],
        "energies": {"time": [float(r["time"]) for r in rows], **{e: [float(r[e]) for r in rows] for e in ENERGIES}},
    }


def apart(a, b):
    """The largest difference of two energy histories, in parts of the largest energy."""
    largest = max(abs(x) for e in ENERGIES for x in b[e])
    if any(len(a[e]) != len(b[e]) for e in ENERGIES):
        return float("inf")
    return max(abs(x - y) for e in ENERGIES for x, y in zip(a[e], b[e])) / largest


def main():
    version = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
    print(version.splitlines()[0])
    work = scratch("regression")
    scenes = sorted(f[:-5] for f in os.listdir(here) if f.endswith(".toml"))
    check(len(scenes) >= 4, f"{len(scenes)} scenes")
    now = {scene: results(work, scene) for scene in scenes}
    if "--update" in sys.argv[2:]:
        with open(stored, "w") as f:
            json.dump(now, f, indent=1, sort_keys=True)
            f.write("\n")
        print(f"stored in {stored}: commit it alone, and say why the bits change")
        sys.exit(0)
    reference = json.load(open(stored))
    check(sorted(reference) == scenes, f"stored: {', '.join(reference)}; store others by --update")
    for scene in sorted(set(scenes) & set(reference)):
        got, kept = now[scene], reference[scene]
        difference = apart(got["energies"], kept["energies"])
        check(
            got["state_hash"] == kept["state_hash"],
            f"{scene}: state_hash {got['state_hash']}, stored {kept['state_hash']} (energies differ by {difference:.2g})",
        )
        check(difference == 0, f"{scene}: the energies of history.csv are those stored, to the bit ({difference:.2g})")
    # The comparison must be able to fail: a slightly other soil is another result.
    changed = results(work, "dry_3d", "--set", "soil.sand.young=1.801e6")
    check(
        changed["state_hash"] != now["dry_3d"]["state_hash"] and apart(changed["energies"], now["dry_3d"]["energies"]) > 1e-6,
        "another Young's modulus gives another hash and other energies",
    )
    finish()


if __name__ == "__main__":
    main()
