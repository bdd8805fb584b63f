#!/usr/bin/python3
"""Bodies far apart, and periods of very many blocks: what runs on one rank runs on two with the same bits, what does not is refused alike
on any number of ranks before anything is written, and memory stays what kuzure check says."""
import json
import os
import resource
import shutil
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, program, scratch

SCENE = """title = "two small bodies"
dimensions = 3
[space]
spacing = 0.04
{space}
[time]
end = 0.0005
step = 1.0e-4
[soil.sand]
density = 1850.0
young = 1.8e6
poisson = 0.3
friction_angle = 25.0
[[body]]
soil = "sand"
box = {{ low = [0.0, 0.0, 0.0], high = [0.16, 0.16, 0.16] }}
[[body]]
soil = "sand"
box = {{ low = [{x}, {y}, {z}], high = [{x}.16, {y}.16, {z}.16] }}
[effects]
gravity = [0.0, 0.0, -9.81]
"""


def little():  # 4 GB of addresses: a start that would eat the machine ends here
    resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))


def run(work, scene, out, ranks):
    mpi = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
    return subprocess.run(
        [*mpi, program, "run", scene, "-o", out, "--quiet", "--threads", "1"],
        capture_output=True,
        text=True,
        cwd=work,
        timeout=300,
        preexec_fn=little,
    )


work = scratch("far")


def main():
    for name, at, space, runs in (
        ("400 m apart", (400, 400, 0), "", True),
        ("20 km apart along x", (20000, 0, 0), "", True),
        ("20 km above", (0, 0, 20000), "", True),
        ("20 km apart", (20000, 20000, 0), "", False),
        ("9e8 m apart", (900000000, 900000000, 0), "", False),
        ("9e8 m apart along x", (900000000, 0, 0), "", False),
        ("9e8 m above", (0, 0, 900000000), "", False),
    ):
        with open(work + "/scene.toml", "w") as f:
            f.write(SCENE.format(x=at[0], y=at[1], z=at[2], space=space))
        hashes = set()
        for ranks in (1, 2, 3):
            shutil.rmtree(work + "/out", ignore_errors=True)
            done = run(work, "scene.toml", "out", ranks)
            if runs:
                check(done.returncode == 0, f"{name} on {ranks}: exit {done.returncode} {done.stderr.strip()[-300:]}")
                if done.returncode == 0:
                    hashes.add(json.load(open(work + "/out/summary.json"))["state_hash"])
            else:
                check(
                    done.returncode == 2 and "far apart" in done.stderr and "Remedy" in done.stderr,
                    f"{name} on {ranks}: exit {done.returncode} {done.stderr.strip()[-300:]}",
                )
                check(not os.path.exists(work + "/out"), f"{name} on {ranks}: nothing is written")
        check(len(hashes) == runs, f"{name}: one hash on any number of ranks {hashes}")
    # A period that needs more blocks than have numbers, where it is cut at all: judged before anything is written.
    with open(work + "/scene.toml", "w") as f:
        f.write(SCENE.format(x=1, y=0, z=0, space='low = [0.0, -9.0, -9.0]\nhigh = [400000.0, 9.0, 9.0]\nperiodic = ["x"]'))
    done = run(work, "scene.toml", "out", 2)
    check(
        done.returncode in (0, 2) and (done.returncode == 0) == os.path.exists(work + "/out"),
        f"a period of 400 km on 2: exit {done.returncode}, a directory only with a run: {done.stderr.strip()[-300:]}",
    )
    finish()


if __name__ == "__main__":
    main()
