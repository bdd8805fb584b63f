#!/usr/bin/python3
"""Starts other than bodies as they are drawn: soil that settles before t = 0, and the last state of another run ([start] from).

Any ranks give the same bits; what does not fit is refused with exit 2 and nothing written; a stop while it settles leaves nothing."""
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile

import h5py
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, failures, program

work = tempfile.mkdtemp(prefix="kuzure-start-")

BANK = """title = "bank"
dimensions = 2
[space]
spacing = {dx}
[time]
end = 0.1
[soil.s]
density = 1900.0
young = 2.0e7
poisson = 0.3
cohesion = {cohesion}
friction_angle = 25.0
cone = "plane strain"
[[body]]
soil = "s"
polygon = {{ points = [[0, 0], [8, 0], [8, 1], [5.1, 1], [3, 3], [0, 3]] }}
{stress}
[[wall]]
box = {{ low = [-1.0, 0.0, -1.0], high = [9.0, 0.0, 0.0] }}
[[wall]]
box = {{ low = [-1.0, 0.0, 0.0], high = [0.0, 0.0, 4.0] }}
surface = "smooth"
{gate}
[effects]
gravity = [0.0, 0.0, -9.81]
viscosity = {{ alpha = 0.1 }}
[output]
every = 1.0
fields = ["displacement", "stress", "plastic_strain"]
{more}
"""
AT_REST = 'stress = "at rest"'
GATE = """[[wall]]
box = { low = [8.0, 0.0, 0.0], high = [9.0, 0.0, 4.0] }
surface = "smooth"
"""


def scene(name, dx=0.25, cohesion=1e4, stress=AT_REST, gate=GATE, more=""):
    path = os.path.join(work, name + ".toml")
    with open(path, "w") as f:
        f.write(BANK.format(dx=dx, cohesion=cohesion, stress=stress, gate=gate, more=more))
    return path


def call(*args, expect=0, ranks=0):
    launcher = ["mpirun", "-n", str(ranks)] if ranks else []
    done = subprocess.run([*launcher, program, *args], capture_output=True, text=True, timeout=300, cwd=work)
    check(done.returncode == expect, f"{' '.join(args)[:80]}: exit {done.returncode}, expected {expect} {done.stderr.strip()[-300:]}")
    return done


def summary(directory):
    with open(os.path.join(work, directory, "summary.json")) as f:
        return json.load(f)


def first_state(directory):
    """Displacement, stress and plastic strain of the first snapshot."""
    with h5py.File(os.path.join(work, directory, "snapshots", "state_000000.hdf")) as f:
        data = f["VTKHDF"]["PointData"]
        soil = data["kind"][:] == 0 if "kind" in data else slice(None)
        return {key: data[key][:][soil] for key in ("displacement", "stress", "plastic_strain")}


def main():
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    # ---- settling
    bank = scene("bank")
    report = json.loads(call("check", bank, "--json").stdout)
    notes = {note["name"]: note["why"] for note in report["effects"]["on"]}
    check("before t = 0, about" in notes.get("settling", ""), "check says that it settles, why, and what that takes")
    out = call("run", bank, "-o", "settled").stdout
    check("settled before t = 0" in out, "the run says how it settled")
    one = summary("settled")
    check(one["settling"]["at_rest"] and not one["settling"]["held"], "summary.json: at rest, not held")
    check(abs(one["resting_volume_ratio"] - 1) < 0.02, f"resting_volume_ratio {one['resting_volume_ratio']:.4f} near 1")
    state = first_state("settled")
    check(float(np.abs(state["displacement"]).max()) == 0, "displacement begins at release")
    check(float(np.abs(state["plastic_strain"]).max()) == 0, "so does plastic strain")
    check(float(state["stress"].min()) < -3e4, "the first snapshot carries the weight")
    for ranks in (2, 3):
        call("run", bank, "-o", f"settled{ranks}", ranks=ranks)
        check(summary(f"settled{ranks}")["state_hash"] == one["state_hash"], f"{ranks} ranks: the same bits")
    slope = scene("slope", cohesion=0.0, gate="")
    out = call("run", slope, "-o", "slope").stdout
    check(summary("slope")["settling"]["held"] and "held" in out, "a slope that does not stand is held, and that is said")

    # ---- from another run
    again = scene("again", stress="", gate="", more='[start]\nfrom = "settled"')
    out = call("run", again, "-o", "again").stdout
    check("starting from" in out and "settled/checkpoint.h5" in out, "the run says where it starts from")
    two = summary("again")
    check(two["time"] == 0.1 and two["started_from"]["time"] == 0.1 and "settling" not in two, "time begins anew; nothing settles")
    check(two["peak_speed"] > 10 * one["peak_speed"], "without its gate the soil moves")
    check(float(np.abs(first_state("again")["displacement"]).max()) == 0, "displacement begins anew")
    call("run", again, "-o", "again2", ranks=2)
    check(summary("again2")["state_hash"] == two["state_hash"], "2 ranks: the same bits")
    kept = scene("kept", stress="", more='[start]\nfrom = "settled/checkpoint.h5"')
    call("run", kept, "-o", "kept")
    check(summary("kept")["peak_speed"] < 2 * one["peak_speed"] + 1e-4, "with its gate it stays at rest")
    os.mkdir(os.path.join(work, "elsewhere"))
    shutil.copytree(os.path.join(work, "settled"), os.path.join(work, "elsewhere", "settled"))
    shutil.copy(kept, os.path.join(work, "elsewhere", "kept.toml"))
    done = call("run", "elsewhere/kept.toml", "-o", "elsewhere/out")
    check("elsewhere/settled" in done.stdout, "the path counts from the scene file's directory")

    # ---- what does not fit
    wrong = {
        "finer": (dict(dx=0.125, stress="", more='[start]\nfrom = "settled"'), "space.spacing is 0.25 m, here it is 0.125 m"),
        "nowhere": (dict(stress="", more='[start]\nfrom = "not_there"'), "found nothing there"),
        "empty": (dict(stress="", more='[start]\nfrom = "elsewhere"'), "found none"),
    }
    for name, (changes, words) in wrong.items():
        done = call("run", scene(name, **changes), "-o", "wrong_" + name, expect=2)
        check(words in done.stderr, f"{name}: {words}")
        check(not os.path.exists(os.path.join(work, "wrong_" + name)), f"{name}: nothing is written")

    # ---- stopped while it settles
    # It says so after two seconds of it. A fast machine has settled by then, or while this process was away: then with more particles.
    for dx in (0.02, 0.01, 0.005):
        out = f"stopped{dx}"
        with open(os.path.join(work, "err"), "w") as err:
            running = subprocess.Popen(
                [program, "run", scene("fine", dx=dx), "-o", out], cwd=work, stdout=subprocess.PIPE, stderr=err, text=True
            )
        said = ""
        for line in running.stdout:
            said += line
            if line.startswith(("settling", "settled")):
                running.send_signal(signal.SIGTERM)
        running.wait(300)
        if "settled before t = 0" not in said:
            break
    with open(os.path.join(work, "err")) as f:
        said += f.read()
    check(running.returncode == 5 and "nothing was written" in said, f"a stop while it settles: exit {running.returncode}, expected 5")
    left = os.listdir(os.path.join(work, out)) if os.path.exists(os.path.join(work, out)) else []
    check(not left, f"it leaves nothing: {left}")

    if not failures:
        shutil.rmtree(work)
    print(f"{len(failures)} failures" + (f", see {work}" if failures else ""))
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
