#!/usr/bin/python3
"""The gallery: every ready scene is listed, written as it is, passes `kuzure check` with no warning that its text does not explain, begins
to move when run, and is shown in docs/gallery.md; gallery_long_test.py runs them to their ends. Run as gallery_test.py PROGRAM."""
import os
import re
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, need, program, root, scratch

sys.path.insert(0, os.path.join(root, "python"))
os.environ["KUZURE"] = program
import kuzure

SCENES = Path(root, "jobs/scenes")
PAGE = Path(root, "docs/gallery.md")
# Warnings that belong to a scene, with the words in its text that explain them.
EXPLAINED = {
    "column": (("slenderness",), "run too far"),
    "hirata_208": (("base_strain", "mach"), "its own weight strains it"),
    "layered_slope": (("settled before t = 0",), "held while it settles"),
    "gravity_wall": (("settled before t = 0",), "held while it settles"),
}
# The cubes of Hirata for the short run: coarser, floors as thick in layers.
COARSE = {"space.spacing": 0.16, "time.step": 4e-4, "wall.0.box.low": [0.0, 0.0, -0.48]}
SHORT = {
    "hirata_52": COARSE,
    "hirata_52_default": {k: v for k, v in COARSE.items() if k != "time.step"},
    "hirata_104": {**COARSE, "space.spacing": 0.32, "wall.0.box.low": [0.0, 0.0, -0.96]},
    "hirata_208": {**COARSE, "space.spacing": 0.64, "wall.0.box.low": [0.0, 0.0, -1.92]},
    "quickstart": {"space.spacing": 0.08, "time.step": 2e-4, "wall.0.box.low": [0.0, 0.0, -0.32]},
}


def end_of(text):
    return float(re.search(r"^\[time\]\nend\s*=\s*([0-9.]+)", text, re.M)[1])


def unexplained(name, text, warnings):
    words, explanation = EXPLAINED.get(name, ((), ""))
    # Whether the results of the largest fit on the disk of the day says nothing of the scene.
    ours = [w for w in warnings if not w.startswith("on this machine")]
    return [w for w in ours if not (w.startswith(words) and explanation in text.replace("\n# ", " "))]


def main():
    work = Path(scratch("gallery"))
    files = {f.stem: f.read_text() for f in sorted(SCENES.glob("*.toml"))}
    need(len(files) >= 23, f"{len(files)} scenes")
    check(sorted(kuzure.examples()) == sorted(files), "kuzure example lists every scene of jobs/scenes")
    listed = subprocess.run([program, "example"], capture_output=True, text=True).stdout
    check(all(re.search(rf"^  {n} +\S", listed, re.M) for n in files), "for people too")
    wrong = subprocess.run([program, "example", "bnak"], capture_output=True, text=True)
    check(
        wrong.returncode == 2 and 'did you mean "bank"?' in wrong.stderr and not wrong.stdout,
        "a name that is not there: exit 2, the nearest",
    )
    page = PAGE.read_text()
    for name, text in files.items():
        need(kuzure.example(name) == text, f"kuzure example {name} is not the file")
        need(text.startswith("# ") or name.startswith("hirata"), f"{name}: no comment says what it is")
        warnings = kuzure.check(SCENES / f"{name}.toml")["warnings"]
        need(not unexplained(name, text, warnings), f"{name}: warnings that nothing explains: {unexplained(name, text, warnings)}")
        need(re.search(rf"^## {name}$|`{name}`", page, re.M), f"docs/gallery.md does not name {name}")
    figures = re.findall(r"!\[[^\]]+\]\((figures/gallery_\w+\.png)\)", page)
    check(len(figures) >= 19, f"{len(figures)} pictures in docs/gallery.md")
    for figure in figures:
        file = PAGE.parent / figure
        need(file.exists() and 4000 < file.stat().st_size < 60000, f"{figure}: missing, empty or 60 kB and more")
    shown = {f.name for f in (PAGE.parent / "figures").glob("gallery_*.png")} - {Path(f).name for f in figures}
    need(not shown, f"pictures that the page does not show: {shown}")

    # The control: a warning that its scene does not explain is seen.
    (work / "thin.toml").write_text(files["bank"].replace("low = [-0.2, 0.0, -0.2]", "low = [-0.2, 0.0, -0.05]"))
    check(unexplained("bank", files["bank"], kuzure.check(work / "thin.toml")["warnings"]), "a wall too thin would be seen")
    check(
        unexplained("column", "no words", ["slenderness: x"]) and not unexplained("column", "they run\n# too far", ["slenderness: x"]),
        "and words that lack",
    )

    for name, text in files.items():
        # A tenth of its time, and two pictures.
        end = (0.03 if name == "embankment" else 0.1) * end_of(text)
        sets = {"time.end": end, "output.every": end, **SHORT.get(name, {})}
        if "damping" in text:
            sets["effects.damping.until"] = 0.5 * end
        run = kuzure.run(SCENES / f"{name}.toml", work / name, threads=1, **sets)
        s = run.summary
        # what is left out of a tenth of the time
        said = [w for w in s["warnings"] if not re.match(r"event\.\d+: it comes at .* the run ends", w)]
        moved = abs(run.snapshot()["displacement"]).max()
        good = s["exit_code"] == 0 and abs(s["energy"]["residual"]) < 0.01 and 0 < moved < 100 and not unexplained(name, text, said)
        check(
            good, f"{name}: {s['steps']} steps of {s['soil_particles']}, moved {moved:.3g} m, residual {s['energy']['residual']:.1e} {said}"
        )
    finish()


if __name__ == "__main__":
    main()
