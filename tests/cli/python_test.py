#!/usr/bin/python3
"""python/kuzure: runs the program, reads what it leaves with units, says what is wrong; as it stands in the tree, installed by pip without a
network, with pandas and without; the example's figures. Run as python_test.py PROGRAM."""
import csv
import json
import os
import re
import shutil
import struct
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import block, check, finish, program, root, scratch

sys.path.insert(0, os.path.join(root, "python"))
os.environ["KUZURE"] = program
import h5py
import numpy as np

import kuzure
from kuzure.tables import read_table

work = Path(scratch("python"))
SCENE = block((0.32, 0, 0.32), ((-0.4, 0, -0.16), (0.8, 0, 0)), end=0.1, step=None, output="every = 0.05\nhistory = 0.01")


def refused(error, words, action):
    """The action throws this error, with these words in it."""
    try:
        action()
    except error as e:
        lacking = [w for w in words if w not in str(e)]
        check(not lacking, f"{error.__name__} says {words}: {str(e)[:200]}")
        return e
    except Exception as e:
        check(False, f"expected {error.__name__}, found {type(e).__name__}: {e}")
    else:
        check(False, f"expected {error.__name__} with {words}, found none")


def python(*words, **env):
    """Another Python: what it printed."""
    done = subprocess.run(
        ["/usr/bin/python3", *map(str, words)], capture_output=True, text=True, cwd=os.getcwd(), env={**os.environ, **env}
    )
    check(done.returncode == 0, f"python3 {' '.join(map(str, words))[:90]}: exit {done.returncode} {done.stderr[-600:]}")
    return done.stdout


def runs():
    (work / "s.toml").write_text(SCENE)
    run = kuzure.run(work / "s.toml", work / "a", threads=1, space__spacing=0.04, soil={"sand": {"cohesion": 100.0}})
    written = (work / "a/scene.toml").read_text()
    check("cohesion = 100.0" in written, "sets by keyword and by dict reach the scene")
    check(run.summary["exit_code"] == 0 and run.summary["soil_particles"] == 64, "summary.json")

    # A second reading of the same files, by other means.
    with open(work / "a/history.csv") as f:
        rows = list(csv.reader(f))
    by_hand = [float(row[rows[0].index("height")]) for row in rows[2:]]
    check(list(run.history["height"]) == by_hand and len(by_hand) == 11, "history: every row, every digit")
    table = read_table(work / "a/history.csv")
    check(
        table.units["kinetic"] == "J/m" and table.units["max_speed"] == "m/s" and table["step"].dtype == np.int64,
        "history: units and types",
    )
    check(
        run.history.attrs["units"] == table.units and type(run.history).__name__ == "DataFrame", "a DataFrame with units, where pandas is"
    )
    front = run.front()
    check(list(front["max_x"]) == list(table["front_max_x"]) and "min_y" in front, "front()")
    check(len(run.table("progress")["balance"]) > 0, "table('progress')")
    rows = 'time,wall,force_x\n# s,,N/m\n0,"gate, the left",1.5\n0,7,nan\n'
    (work / "a/forces.csv").write_text(rows)
    forces = run.table("forces")
    check(list(forces["wall"]) == ["gate, the left", "7"] and forces["force_x"][0] == 1.5, "columns without a unit are words")
    (work / "a/forces.csv").write_text(rows.replace("1.5", "gate"))
    refused(kuzure.DamagedFile, ["forces.csv", ":3:"], lambda: run.table("forces"))
    (work / "a/forces.csv").unlink()

    times = run.snapshots.times
    check(len(run.snapshots) == 3 and times[0] == 0 and abs(times[-1] - 0.1) < 1e-12, f"snapshots at {times}")
    check(
        [run.snapshot(t).time for t in (-1, 0.051, 9)] == list(times) and run.snapshot().time == times[-1],
        "snapshot(t) is the one next to it",
    )
    s = run.snapshot()
    with h5py.File(s.file) as f:
        ids, stress = f["VTKHDF/PointData/id"][:], f["VTKHDF/PointData/stress"][:]
    check(list(s["id"]) == list(range(64)) and s["stress"].shape == (64, 6), "particles in the order of their ids")
    check(all(np.array_equal(s["stress"][k], stress[list(ids).index(k)]) for k in (0, 17, 63)), "each with its own values")
    check(np.array_equal(s["stress_zz"], s["stress"][:, 2]) and np.array_equal(s["velocity_z"], s["velocity"][:, 2]), "components by name")
    check(s.units["stress"] == "Pa" and s.units["position"] == "m" and s.title == "a block", "units and title of a snapshot")
    first = run.snapshot(0)
    check(np.allclose(s["position"] - s["displacement"], first["position"]), "the first snapshot's walls are not among its soil")
    check(run.walls.size == run.summary["wall_particles"] and (run.walls["position"][:, 2] < 0).all(), "walls")
    refused(KeyError, ["stress_rr", "plastic_strain"], lambda: s["stress_rr"])

    surface = run.surface(0.0, window=0.08)
    check(surface.spread == "plane" and surface.start == (0, 0.32) and abs(surface.top - 0.32) < 1e-12, "surface() before anything moved")
    area = np.trapz(run.surface(window=0.04).height, run.surface(window=0.04).at)
    check(abs(area / 0.32**2 - 1) < 0.03, f"surface(): the area under it is the soil's: {area:.4f}")
    picture = run.picture(color="stress_zz", file=work / "p.png")
    check(struct.unpack(">II", picture.read_bytes()[16:24])[0] > 300, "picture()")
    lines = run.plot("kinetic", "plastic").get_lines()
    check(len(lines) == 2 and list(lines[0].get_ydata()) == list(table["kinetic"]), "plot()")
    refused(kuzure.Error, ["different units", "J/m"], lambda: run.plot("kinetic", "height"))
    refused(KeyError, ["hight"], lambda: run.plot("hight"))

    # A scene as nested dicts, two ranks, a restart, the program's own choice of the directory.
    sand = {"density": 1850.0, "young": 1.8e6, "poisson": 0.3, "friction_angle": 25.0, "cohesion": 100.0}
    scene = {
        "title": "a block",
        "dimensions": 2,
        "space": {"spacing": np.float64(0.04), "h": 1.2},
        "time": {"end": 0.1},
        "soil": {"sand": sand},
        "body": [{"soil": "sand", "box": {"low": [0, 0, 0], "high": np.array([0.32, 0, 0.32])}}],
        "wall": [{"box": {"low": [-0.4, 0, -0.16], "high": [0.8, 0, 0.0]}}],
        "effects": {"gravity": (0.0, 0.0, -9.81)},
        "output": {"every": 0.05, "history": 0.01},
    }
    two = kuzure.run(scene, work / "b", ranks=2, threads=1)
    check(
        two.summary["ranks"] == 2 and two.summary["state_hash"] == run.summary["state_hash"], "a scene as dicts on two ranks: the same bits"
    )
    longer = kuzure.run(scene, work / "b", restart=True, threads=1, time__end=0.12)
    check(abs(longer.summary["time"] - 0.12) < 1e-12, "restart=True goes on")
    os.chdir(work)
    own = kuzure.run("s.toml", threads=1, time__end=0.01)
    check(own.directory == Path("results/s") and own.summary["exit_code"] == 0, f"without a directory: {own.directory}")
    refused(kuzure.Error, ["give a directory"], lambda: kuzure.run(scene))
    check(kuzure.check("s.toml", space__spacing=0.02)["soil_particles"] == 256, "check()")
    check("bank" in kuzure.examples() and 'title      = "a bank' in kuzure.example("bank"), "the gallery")

    study = run.study({"space.spacing": [0.08, 0.04]}, work / "study", measures=["height"])
    check(len(study.points) == 2 and study.run(1).summary["exit_code"] == 0, "study(): two points, two runs")
    return run


def errors(run):
    refused(kuzure.NotARun, ["nowhere", "no such directory"], lambda: kuzure.Run("nowhere"))
    refused(kuzure.NotARun, ["no scene.toml"], lambda: kuzure.Run(work))
    refused(kuzure.NotARun, ["study.json"], lambda: kuzure.Study(work))
    failed = refused(
        kuzure.ProgramFailed, ["exit code 2", "spacin", "did you mean"], lambda: kuzure.run(work / "s.toml", work / "c", space__spacin=0.1)
    )
    check(failed.exit_code == 2 and not (work / "c").exists(), "a wrong key: exit code 2, nothing written")
    failed = refused(
        kuzure.ProgramFailed,
        ["exit code 3"],
        lambda: kuzure.run(work / "s.toml", work / "c", space={"low": [-1, 0, -1], "high": [1, 0, 0.5]}, body__0__velocity=[9.0, 0, 0]),
    )
    check(
        failed.exit_code == 3 and kuzure.Run(failed.directory).snapshot().failed_particle is not None,
        "numbers that fail: 3, and what is there can be read",
    )
    refused(kuzure.ProgramFailed, ["not empty"], lambda: kuzure.run(work / "s.toml", work / "a"))
    refused(kuzure.NoProgram, ["/no/kuzure"], lambda: kuzure.run(work / "s.toml", work / "d", program="/no/kuzure"))
    script = "import kuzure\ntry: kuzure.program()\nexcept kuzure.NoProgram as e: print(e)"
    shutil.copytree(Path(root, "python/kuzure"), work / "away/kuzure", ignore=shutil.ignore_patterns("__pycache__"))
    words = python("-c", script, KUZURE="", PATH="/nowhere", PYTHONPATH=str(work / "away"))
    check("KUZURE" in words and "build it" in words, f"no program anywhere: {words.strip()}")

    def damaged(file, change, words, action):
        file = work / "a" / file
        whole = file.read_bytes()
        file.write_bytes(change(whole))
        refused(kuzure.DamagedFile, [str(file), *words], action)
        file.write_bytes(whole)

    last = run.snapshots.files[-1].relative_to(work / "a")
    damaged(last, lambda b: b[: len(b) // 2], [], lambda: run.snapshot()["stress"])
    damaged(last, lambda b: b"no HDF5" + b[7:], ["not a snapshot"], run.snapshot)
    damaged("summary.json", lambda b: b[:-9], [], lambda: run.summary)
    damaged("history.csv", lambda b: b.replace(b"0.", b"O.", 1), [":3:"], lambda: run.history)
    damaged("history.csv", lambda b: b.split(b"\n", 2)[0] + b"\n" + b.split(b"\n", 2)[2], ["units"], lambda: run.history)
    damaged("history.csv", lambda b: b"\xff\xfe" + b, [], lambda: run.history)
    file = work / "a/history.csv"
    whole = file.read_bytes()
    file.write_bytes(whole[:-20])
    check(len(run.history) == 10, "a torn last row, of a run that goes on, is left out")
    file.unlink()
    refused(kuzure.NotARun, ["history.csv", "no such file"], lambda: run.history)
    file.write_bytes(whole)


def installed():
    # Without pandas and matplotlib: they cannot be imported.
    for name in ("pandas", "matplotlib"):
        (work / "without" / name).mkdir(parents=True)
        (work / "without" / name / "__init__.py").write_text("raise ImportError('not here')")
    script = """import kuzure
r = kuzure.Run("a")
h = r.history
print(type(h).__name__, h.units["height"], h.height[-1] == h["height"][-1], h.columns[0])
try: r.plot()
except kuzure.Error as e: print(e)
"""
    said = python("-c", script, PYTHONPATH=f"{work}/without:{root}/python")
    check(said.startswith("Table m True time\n") and "python3-matplotlib" in said, f"without pandas and matplotlib: {said.strip()}")

    # pip, from the tree, without a network. It builds beside its sources: from a copy.
    tree = work / "tree"
    shutil.copytree(Path(root, "python"), tree, ignore=shutil.ignore_patterns("__pycache__", "build", "*.egg-info"))
    python(
        "-m",
        "pip",
        "install",
        "-q",
        "--no-index",
        "--no-build-isolation",
        "--no-deps",
        "--target",
        work / "site",
        tree,
        PIP_ROOT_USER_ACTION="ignore",
    )
    said = python(
        "-c", "import kuzure; print(kuzure.__file__, kuzure.__version__, len(kuzure.Run('a').history))", PYTHONPATH=str(work / "site")
    )
    check(said.startswith(str(work / "site")) and said.split()[1:] == ["0.1.0", "11"], f"installed by pip: {said.strip()}")
    version = json.loads((work / "a/summary.json").read_text())["version"]
    check(f"kuzure {kuzure.__version__}" in version, f"the package's version is the program's: {version}")

    said = python(Path(root, "python/examples/figures.py"), "a", "-o", "figures", PYTHONPATH=str(work / "site"))
    drawn = said.split()
    check(len(drawn) == 5 and all((work / f).stat().st_size > 5000 for f in drawn), f"the example's figures: {drawn}")


def as_documented():
    """The block of docs/python.md, as it is written there."""
    code = re.search(r"```python\n(.*?)```", Path(root, "docs/python.md").read_text(), re.S)[1]
    (work / "page").mkdir()
    os.chdir(work / "page")
    said = python("-c", code, PYTHONPATH=str(work / "site"), MPLBACKEND="Agg").splitlines()
    check(
        len(said) >= 5 and said[2].endswith(" Pa") and Path("energies.png").exists() and Path("strain.png").exists(),
        f"docs/python.md: {said[-1:]}",
    )


def main():
    os.chdir(work)
    run = runs()
    errors(run)
    installed()
    as_documented()
    finish()


if __name__ == "__main__":
    main()
