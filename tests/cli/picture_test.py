#!/usr/bin/python3
"""kuzure picture: the run's own pictures again, other colours and views, one moment, and what is wrong said with its exit code."""
import glob
import json
import os
import struct
import subprocess
import sys

import h5py

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import block, check, finish, program, scratch

work = scratch("picture")


def call(*args, expect=0, ranks=1):
    mpi = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    done = subprocess.run([*mpi, program, *args], capture_output=True, text=True, timeout=600, cwd=work)
    check(done.returncode == expect, f"{' '.join(args)[:90]}: exit {done.returncode}, expected {expect} {done.stderr.strip()[-300:]}")
    return done


def contents(pattern):
    return {os.path.basename(f): open(f, "rb").read() for f in sorted(glob.glob(os.path.join(work, pattern)))}


def size(png):
    return struct.unpack(">II", png[16:24])


def scene(title, flat):
    return block(
        (0.3, 0 if flat else 0.3, 0.3),
        ((-0.3, -0.3, -0.15), (0.6, 0.6, 0)),
        title=title,
        young="1.0e6",
        spacing=0.05,
        h=None,
        end=0.02,
        step=None,
        effects="viscosity = { alpha = 0.1 }",
        output='every = 0.005\nfields = ["stress"]\npicture = { view = "oblique", color = "displacement" }',
    )


def main():
    for name, title in (("solid", "砂の崩壊 3-D"), ("flat", "plane strain")):
        with open(os.path.join(work, name + ".toml"), "w") as f:
            f.write(scene(title, name == "flat"))
    call("run", "solid.toml", "-o", "solid", "--quiet", "--threads", "1")
    call("run", "solid.toml", "-o", "shared", "--quiet", "--threads", "1", ranks=2)
    own = contents("solid/picture_*.png")
    snapshots = sorted(glob.glob(work + "/solid/snapshots/state_*.hdf"))
    check(len(own) == len(snapshots) == 5 and len({size(p) for p in own.values()}) == 1, "a picture a snapshot, all of one size")
    check(contents("shared/picture_*.png") == own, "two ranks draw the same bytes")
    with h5py.File(snapshots[-1]) as f:
        check(
            set(f["VTKHDF/PointData"]) == {"id", "kind", "soil", "stress", "displacement"}, "what colours the pictures is in the snapshots"
        )
    check(
        json.load(open(work + "/solid/summary.json"))["walls_in"] == ["snapshots/state_000000.hdf", "snapshots/walls.hdf"],
        "the summary says where the walls are",
    )

    # ---- afterwards
    for f in glob.glob(work + "/solid/picture_*.png"):
        os.remove(f)
    said = call("picture", "solid", "--threads", "3").stdout.split()
    check(contents("solid/picture_*.png") == own, "drawn anew, with three threads, they have the same bytes")
    check(said == [f"solid/{n}" for n in own], "their names are said")
    said = call("picture", "solid", "--color", "pressure", "--view", "cut", "--at", "0.011").stdout.split()
    check(
        said == ["solid/picture_pressure_cut_000002.png"] and os.path.exists(work + "/" + said[0]),
        "one moment in other colours, under a name of its own",
    )
    call("picture", "solid", "--color", "stress_zz", "--view", "side", "--range", "-5e3", "0", "-o", "end.png")
    check(os.path.exists(work + "/end.png"), "-o: the end, into that file")
    call("picture", "solid", "--at", "0.02", "-o", "same.png", ranks=2)
    check(open(work + "/same.png", "rb").read() == own["picture_000004.png"], "one picture alone has the camera and the range of all")
    call("report", "solid")
    check(open(work + "/solid/report.html").read().count("data:image/png") == 3, "the report shows the run's own pictures only")

    # ---- two dimensions
    call("run", "flat.toml", "-o", "flat", "--quiet", "--threads", "1")
    check(len(contents("flat/picture_*.png")) == 5, "a run in the plane has its pictures")
    check("2-D" in call("picture", "flat", "--view", "top", expect=2).stderr, "it can be seen from the side only")
    check(call("picture", "flat", "--view", "side", "--at", "0").stdout.split() == ["flat/picture_000000.png"], "as its own pictures do")

    # ---- what is wrong
    before = contents("solid/*.*")
    wrong = call("picture", "solid", "--color", "presure", expect=2).stderr
    check(
        "presure" in wrong and 'did you mean "pressure"' in wrong and "displacement" in wrong,
        "an unknown field: the nearest and all known ones are named",
    )
    check("[output] fields" in call("picture", "solid", "--color", "speed", expect=2).stderr, "a field that was not kept: how to keep it")
    check("oblique, side, top, cut" in call("picture", "solid", "--view", "front", expect=2).stderr, "an unknown view")
    check("0 to 0.02" in call("picture", "solid", "--at", "3", expect=2).stderr, "a time after the end: the times there are")
    call("picture", "solid", "--range", "2", "1", expect=2)
    check("found nothing" in call("picture", "nowhere", expect=2).stderr, "no such directory")
    os.mkdir(work + "/empty")
    check("scene.toml" in call("picture", "empty", expect=2).stderr, "no result directory")
    check("found a file" in call("picture", "solid.toml", expect=2).stderr, "a file is no result directory")
    check("presure" in call("picture", "solid", "--color", "presure", expect=2, ranks=2).stderr, "two ranks end alike")
    check(contents("solid/*.*") == before, "nothing of this wrote anything")
    with open(snapshots[2], "r+b") as f:
        f.truncate(2000)
    check("state_000002.hdf" in call("picture", "solid", expect=4).stderr, "a damaged snapshot is named")
    call("picture", "solid", expect=4, ranks=2)
    call("picture", "solid", "--at", "0", "-o", "no/where.png", expect=4)
    for f in snapshots:
        os.remove(f)
    check("no snapshot" in call("picture", "solid", expect=4).stderr, "no snapshots at all")

    # ---- a run that fails, and one that goes on after a stop
    call(
        "run",
        "flat.toml",
        "-o",
        "failed",
        "--quiet",
        "--threads",
        "1",
        "--force-step",
        "--set",
        "time.step=8e-3",
        "--set",
        "time.end=8.0",
        "--set",
        "output.every=0.02",
        expect=3,
    )
    failed = contents("failed/picture_*.png")
    check(
        len(failed) == len(glob.glob(work + "/failed/snapshots/state_*.hdf")), "a run that failed has its pictures, the last of the moment"
    )
    call("picture", "failed")
    check(contents("failed/picture_*.png") == failed, "with the ring around what failed, also when drawn anew")
    open(work + "/flat/picture_000009.png", "wb").close()
    call("run", "flat.toml", "-o", "flat", "--quiet", "--threads", "1", "--restart", "--set", "time.end=0.03")
    names = list(contents("flat/picture_*.png"))
    check(
        names == [f"picture_{k:06d}.png" for k in range(len(glob.glob(work + "/flat/snapshots/state_*.hdf")))],
        f"after a restart: all of them, and none of other snapshots {names}",
    )
    finish()


if __name__ == "__main__":
    main()
