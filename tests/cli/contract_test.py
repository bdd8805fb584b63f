#!/usr/bin/python3
"""INTERFACE of the program: exit codes, messages, files and what is in them."""
import csv
import glob
import json
import os
import signal
import subprocess
import sys

import h5py
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import block, check, finish, program, root, scratch, wait_for

work = scratch("contract")


def call(*args, expect=0, **kw):
    done = subprocess.run([program, *args], capture_output=True, text=True, timeout=600, cwd=work, **kw)
    check(done.returncode == expect, f"{' '.join(args)[:90]}: exit {done.returncode}, expected {expect} {done.stderr.strip()[-200:]}")
    return done


SMALL = block(
    title="small",
    effects="viscosity = { alpha = 0.1, beta = 0.0 }",
    output='every = 0.002\nhistory = 0.0005\npicture = { view = "oblique", color = "displacement" }',
)


def main():
    scene = os.path.join(work, "small.toml")
    with open(scene, "w") as f:
        f.write(SMALL)
    # ---- check
    report = json.loads(call("check", scene, "--json").stdout)
    for key in (
        "soil_particles",
        "wall_particles",
        "dt",
        "steps",
        "memory_bytes",
        "disk_bytes",
        "predicted_seconds",
        "effects",
        "warnings",
    ):
        check(key in report, f"check --json has {key}")
    check(report["soil_particles"] == 512 and report["wall_particles"] == 28 * 28 * 4, "check counts particles")
    check(report["steps"] == 40 and report["dt"] == 1e-4, "check counts steps")
    body, cones = report["bodies"][0], list(report["soils"].values())
    check(
        body["particles"] == 512 and body["mass"] > 0 and abs(body["excess_of_mass"]) < 1e-9,
        f"check weighs a body against its shape's volume: {body}",
    )
    check(all(0 < c["rough_bed_angle"] < c["stress_circle_angle"] < 90 for c in cones), f"check says what a cone acts like: {cones}")
    text = call("check", scene).stdout
    check("the mass of its shape's volume" in text and "atan 3 alpha" in text, "check prints both")
    # ---- run and its files
    call("run", scene, "-o", "out", "--quiet")
    out = os.path.join(work, "out")
    for name in ("scene.toml", "history.csv", "summary.json", "timers.json", "timers.txt", "checkpoint.h5", "snapshots/state.hdf.series"):
        check(os.path.isfile(os.path.join(out, name)), f"the run leaves {name}")
    snaps = sorted(glob.glob(out + "/snapshots/state_*.hdf"))
    check(len(snaps) == 3, f"three snapshots ({len(snaps)})")
    check(len(glob.glob(out + "/picture_*.png")) == 3, "three pictures")
    with h5py.File(snaps[0]) as f, h5py.File(out + "/snapshots/walls.hdf") as walls:
        points, data = f["VTKHDF/Points"], f["VTKHDF/PointData"]
        check(points.shape == (512 + 3136, 3) and points.dtype == np.float64, "the first snapshot has float64 Points of soil and walls")
        check(sorted(data["id"]) == list(range(512 + 3136)), "ids are 0 .. n-1")
        kind = np.array(data["kind"])
        check(int((kind == 0).sum()) == 512 and int((kind == 1).sum()) == 3136, "kind tells soil from wall")
        check(
            np.array_equal(np.array(walls["VTKHDF/Points"]), np.array(points)[kind == 1])
            and set(np.array(walls["VTKHDF/PointData/kind"])) == {1},
            "walls.hdf has the walls alone",
        )
    with h5py.File(snaps[-1]) as f:
        g = f["VTKHDF"]
        points, data = g["Points"], g["PointData"]
        check(points.shape == (512, 3) and points.dtype == np.float64, "later ones have soil only: walls do not move")
        check(
            set(data) >= {"id", "kind", "soil", "velocity", "stress", "density", "plastic_strain", "displacement"}, "PointData is complete"
        )
        check(data["id"].dtype == np.int64 and sorted(data["id"]) == list(range(512)), "soil comes first in the ids")
        soil = np.array(data["kind"]) == 0
        stress = np.array(data["stress"])[soil]
        # sqrt(J2) + alpha I1 <= k: no snapshot shows a stress outside the cone
        I1 = stress[:, :3].sum(1)
        s = stress.copy()
        s[:, :3] -= I1[:, None] / 3
        J2 = 0.5 * (s[:, :3] ** 2).sum(1) + (s[:, 3:] ** 2).sum(1)
        sin = np.sin(np.radians(25))
        alpha = 2 * sin / (np.sqrt(3) * (3 - sin))
        check(float((np.sqrt(J2) + alpha * I1).max()) <= 1e-9 * max(1.0, float(abs(I1).max())), "stresses lie in the cone")
    with open(out + "/history.csv") as f:
        rows = list(csv.reader(f))
    check(rows[0][:3] == ["time", "step", "dt"] and rows[1][0].startswith("#"), "history.csv has header and units")
    check(len(rows) == 2 + 9, f"history.csv has its rows ({len(rows) - 2})")
    first = dict(zip(rows[0], rows[2]))
    check(abs(float(first["height"]) - 0.32) < 1e-9 and abs(float(first["front_max_x"]) - 0.32) < 1e-9, "height and front at the start")
    summary = json.load(open(out + "/summary.json"))
    for key in (
        "status",
        "exit_code",
        "scene_hash",
        "version",
        "ranks",
        "threads",
        "precision",
        "soil_particles",
        "wall_particles",
        "steps",
        "time",
        "wall_seconds",
        "pairs",
        "seconds_per_step",
        "particle_steps_per_second",
        "energy",
        "effects",
        "state_hash",
    ):
        check(key in summary, f"summary.json has {key}")
    check(summary["status"] == "finished" and summary["steps"] == 40 and summary["exit_code"] == 0, "summary.json tells the end")
    # ---- the written scene runs again to the same bits
    call("run", out + "/scene.toml", "-o", "again", "--quiet")
    again = json.load(open(work + "/again/summary.json"))
    check(again["state_hash"] == summary["state_hash"] and again["scene_hash"] == summary["scene_hash"], "scene.toml gives the same bits")
    # ---- nothing is overwritten
    before = open(out + "/summary.json").read()
    call("run", scene, "-o", "out", "--quiet", expect=2)
    check(open(out + "/summary.json").read() == before, "a refused run touches nothing")
    call("run", scene, "-o", "out", "--quiet", "--force")
    check(os.path.isfile(work + "/out.old-1/summary.json"), "--force moves the old results aside")
    # ---- bad input: exit 2, the key named, nothing written
    bad = call("run", scene, "-o", "bad", "--set", "soil.sand.poisson=0.7", expect=2)
    check("poisson" in bad.stderr and not os.path.exists(work + "/bad"), "a bad value is named and nothing is written")
    bad = call("run", scene, "-o", "bad", "--set", "time.stepp=1e-4", expect=2)
    check("step" in bad.stderr, "a misspelt key is named")
    bad = call("run", scene, "-o", "bad", "--set", "time.step=1e-2", expect=2)
    check("step" in bad.stderr and not os.path.exists(work + "/bad"), "a step above the stable limit is refused")
    call("run", "nowhere.toml", expect=2)
    call("frobnicate", expect=2)
    # ---- numbers that fail: exit 3, a snapshot of the moment
    blown = call("run", scene, "-o", "blown", "--quiet", "--force-step", "--set", "time.step=8e-3", "--set", "time.end=8.0", expect=3)
    check("particle" in blown.stderr and "Remedy" in blown.stderr, "a blow-up names the particle and the remedy")
    check(json.load(open(work + "/blown/summary.json"))["exit_code"] == 3, "summary.json tells the failure")
    box = call(
        "run",
        scene,
        "-o",
        "left",
        "--quiet",
        "--set",
        "space.low=[-0.1,-0.1,-0.1]",
        "--set",
        "space.high=[0.33,1,1]",
        "--set",
        "body.0.velocity=[3,0,0]",
        "--set",
        "time.end=0.1",
        expect=3,
    )
    check("left the box" in box.stderr, "a particle that leaves the box is named")
    # ---- stopping on request: exit 5, and on to the same bits
    # Pictures and snapshots are few, so that the disk need not hold those of a run that would take minutes.
    few = ("--set", "output.every=0.02")
    process = subprocess.Popen([program, "run", scene, "-o", "stop", "--quiet", "--force-size", *few, "--set", "time.end=30"], cwd=work)
    rows = lambda: os.path.exists(work + "/stop/history.csv") and len(open(work + "/stop/history.csv").readlines()) > 50
    check(wait_for(rows, process=process), "it has written rows of its history")
    process.send_signal(signal.SIGUSR1)
    check(process.wait(300) == 5, "SIGUSR1 stops with exit 5")
    stopped = json.load(open(work + "/stop/summary.json"))
    check(stopped["status"] == "stopped" and os.path.exists(work + "/stop/checkpoint.h5"), "a stopped run leaves a checkpoint")
    end = (stopped["steps"] + 50) * 1e-4
    call("run", scene, "-o", "stop", "--quiet", "--restart", *few, "--set", f"time.end={end}")
    call("run", scene, "-o", "straight", "--quiet", *few, "--set", f"time.end={end}")
    a, b = (json.load(open(f"{work}/{d}/summary.json")) for d in ("stop", "straight"))
    check(a["state_hash"] == b["state_hash"] and a["pairs"] == b["pairs"], "a stopped and restarted run has the bits of an undisturbed one")
    for key in a["energy"]:
        check(a["energy"][key] == b["energy"][key], f"the restart keeps the ledger: {key}")
    other = call("run", scene, "-o", "stop", "--quiet", "--restart", "--set", "soil.sand.young=2e6", expect=2)
    check("soil.0.young: 1800000.0 there, 2000000.0 here" in other.stderr, "a restart with other physics names the key and both values")
    # ---- after a restart the checkpoint it came from is the last good one
    doomed = ("--set", "space.low=[-1,-1,-1]", "--set", "space.high=[1,1,1]", "--set", "body.0.velocity=[3,0,0]")
    call("run", scene, "-o", "doomed", "--quiet", *doomed, "--set", "time.end=0.01")
    left = call("run", scene, "-o", "doomed", "--quiet", *doomed, "--set", "time.end=1", "--restart", expect=3)
    check("The last good checkpoint is doomed/checkpoint.h5" in left.stderr, "after a restart the checkpoint it began with is named")
    # ---- FILE of --restart: only after "=", and never among the results of another scene
    first = call("run", "--restart", scene, "-o", "fresh", "--quiet", "--set", "time.end=0.001")
    check(first.returncode == 0 and os.path.exists(work + "/fresh/summary.json"), "--restart does not take the scene for its FILE")
    before = {name: open(name, "rb").read() for name in glob.glob(work + "/doomed/*") if os.path.isfile(name)}
    mixed = call("run", scene, "-o", "doomed", "--quiet", "--restart=stop/checkpoint.h5", "--set", "time.end=1", expect=2)
    check("another scene" in mixed.stderr, "a checkpoint does not go on among the results of another scene")
    check(all(open(name, "rb").read() == data for name, data in before.items()), "they stay as they were")
    # ---- words that cannot be written
    for words in (
        ("check", scene),
        ("check", scene, "--json"),
        ("job", scene, "--machine", "slurm", "--nodes", "1"),
        ("reference",),
        ("schema",),
    ):
        with open("/dev/full", "w") as full:
            done = subprocess.run([program, *words], cwd=work, stdout=full, stderr=subprocess.PIPE, text=True)
        check(
            done.returncode == 4 and "defect" not in done.stderr, f"kuzure {words[0]} into a full disk is exit 4, found {done.returncode}"
        )
    # ---- a damaged checkpoint
    path = work + "/straight/checkpoint.h5"
    data = bytearray(open(path, "rb").read())
    data[len(data) // 2] ^= 0x10
    open(path, "wb").write(data)
    call("run", scene, "-o", "straight", "--quiet", "--restart", "--set", f"time.end={end}", expect=4)
    # ---- documents that cannot drift
    check(open(root + "/docs/scene.md").read() == call("reference").stdout, "docs/scene.md is what `kuzure reference` prints")
    call("report", "again")
    page = open(work + "/again/report.html").read()
    check("<svg" in page and "data:image/png" in page and "://" not in page.split("<h2>Scene")[0], "report.html is self-contained")
    call("report", "nowhere", expect=2)
    version = call("--version").stdout
    check(all(word in version for word in ("kuzure", "GCC", "MPI", "HDF5", "METIS")), "--version tells program, compiler and packages")
    # ---- without output.history: the first and the last state
    silent = "".join(line for line in open(scene) if not line.startswith(("history", "every")))
    open(work + "/silent.toml", "w").write(silent)
    call("run", work + "/silent.toml", "-o", "silent", "--quiet", "--set", "time.end=0.001")
    rows = [row.split(",")[0] for row in open(work + "/silent/history.csv") if row[0].isdigit()]
    check(rows == ["0", "0.001"], f"without output.history the first and the last row are written, found {rows}")
    finish()


if __name__ == "__main__":
    main()
