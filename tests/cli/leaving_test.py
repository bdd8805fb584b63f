#!/usr/bin/python3
"""Soil that runs off an elevation model is taken out of the run and counted: the same bits on any ranks, through a restart, with a
ledger that closes, also where all of it leaves. Run as leaving_test.py PROGRAM."""
import json, os, subprocess, sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, legs, program, root, scratch
from terrain_test import CELL, FRICTION, NO_WINDOW, RELEASE, asc, box, geojson, scene

sys.path.insert(0, os.path.join(root, "python"))
import kuzure

work = scratch("leaving")
os.environ["OMP_NUM_THREADS"] = "1"
SCENE = scene(
    ("spacing = 0.5", "spacing = 1.0"),
    ("end = 0.01", "end = 5.0"),
    NO_WINDOW,
    (FRICTION, "friction = 8.0"),
    (RELEASE, RELEASE + ", on_top = true"),
)
SCENE += """[output]
every = 1.0
history = 0.25
[maps]
"""


def run(name, *more, ranks=0, expect=0):
    launcher = ["mpirun", "-n", str(ranks)] if ranks else []
    call = [*launcher, program, "run", "s.toml", "-o", name, "--threads", "1", "-q", *more]
    done = subprocess.run(call, capture_output=True, text=True, timeout=300, cwd=work)
    check(done.returncode == expect, f"{name}: exit {done.returncode} {done.stderr[-600:] if done.returncode != expect else ''}")
    if done.returncode != expect or expect != 0:
        return done.stderr
    return json.load(open(os.path.join(work, name, "summary.json")))


def main():
    with open(os.path.join(work, "dem.asc"), "w") as f:
        f.write(asc([[40 - 0.577 * (i + 0.5) * CELL for i in range(30)]] * 20))
    with open(os.path.join(work, "scar.geojson"), "w") as f:
        f.write(geojson([box(30, 12, 16, 16)]))
    with open(os.path.join(work, "s.toml"), "w") as f:
        f.write(SCENE)

    whole = run("whole")
    share = whole["soil_off_ground"]
    check(0.3 < share < 1, f"most of it has left, not all: {share}")
    left = len(kuzure.Run(os.path.join(work, "whole")).snapshot()["id"]) / whole["soil_particles"]
    check(
        1 - share <= left < 1,
        f"what has left is taken out: {left:.3f} of the particles are there in the end, {1 - share:.3f} on the ground",
    )
    kept = (whole["maps"]["volume"] + whole["maps"]["volume_beyond"]) / whole["soil_particles"]
    check(abs(kept - 1) < 0.02, f"the maps know all of the volume, also of what was taken out: {kept:.4f}")
    check(abs(whole["energy"]["residual"]) < 1e-3, f"the ledger closes: {whole['energy']['residual']}")
    # What leaves first does so at 2 s: falling without end it would be at 35 m/s at 5 s.
    fastest = max(kuzure.Run(os.path.join(work, "whole")).history["max_speed"])
    check(fastest < 25, f"nothing falls on for long: {fastest:.3g} m/s")
    for ranks in (2, 4):
        other = run(f"ranks{ranks}", ranks=ranks)
        check(other["state_hash"] == whole["state_hash"], f"the same bits on {ranks} ranks")
    # In legs that the clock ends somewhere, on one rank and on two in turn.
    finer = run("finer", "--set", "space.spacing=0.7")
    codes = []
    for minutes in legs(finer["wall_seconds"]):
        launcher = ["mpirun", "-n", "2"] if len(codes) % 2 else []
        leg = ["run", "s.toml", "-o", "legs", "--threads", "1", "-q", "--max-minutes", minutes, "--set", "space.spacing=0.7"]
        again = ["--restart"] if codes else []
        codes.append(subprocess.run([*launcher, program, *leg, *again], capture_output=True, timeout=300, cwd=work).returncode)
        if codes[-1] != 5:
            break
    ended = json.load(open(os.path.join(work, "legs", "summary.json")))
    check(codes[-1] == 0 and len(codes) > 1, f"{len(codes)} legs, the last ends with exit {codes[-1]}")
    check(ended["state_hash"] == finer["state_hash"], "have the bits of one run")
    check(ended["soil_off_ground"] == finer["soil_off_ground"] > 0.3, f"and know what has left: {ended['soil_off_ground']:.3f}")

    gone = run("gone", "--set", "time.end=12.0")
    check(gone["soil_off_ground"] == 1, f"in the end all has left: {gone['soil_off_ground']}")
    check(abs(gone["energy"]["residual"]) < 1e-3, f"and the ledger closes: {gone['energy']['residual']}")
    check("has left the ground" in run("closed", "--set", "terrain.edge='closed'", expect=3), "a closed ground ends the run instead")
    finish()


if __name__ == "__main__":
    main()
