#!/usr/bin/python3
"""kuzure study and run --twins as a user meets them: a tiny sweep, its files, resume, failures; error bars in summary.json.

Run as study_test.py PROGRAM.
"""
import json
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import block, program
from runs import Runs

SCENE = block(
    (0.8, 0, 0.8),
    ((-1.2, 0, -0.4), (2.4, 0, 0)),
    title="block",
    young="0.2e6",
    spacing=0.1,
    h=None,
    end=0.15,
    step=None,
    soil='cone = "plane strain"',
    effects="viscosity = { alpha = 0.1, beta = 0.0 }",
)
SWEEP = """scene = "block.toml"
title = "tiny"
measures = ["profile", "run-out", "residual"]
[reference]
finest = "standard"
[base]
preset = "standard"
"space.spacing" = 0.1
[vary]
preset = ["seed", "standard"]
"space.spacing" = [0.2, 0.1]
[[point]]
name = "mixed"
"accuracy.precision" = "mixed"
[[point]]
name = "does not fill"
"space.spacing" = 0.07
"""


def kuzure(*arguments, **more):
    return subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, timeout=300, **more)


class Study(unittest.TestCase):
    def setUp(self):
        self.dir = Path(tempfile.mkdtemp(prefix="kuzure-study-"))
        (self.dir / "block.toml").write_text(SCENE)
        (self.dir / "sweep.toml").write_text(SWEEP)

    def tearDown(self):
        shutil.rmtree(self.dir)

    def study(self, *more, **environment):
        return kuzure("study", self.dir / "sweep.toml", "-o", self.dir / "out", *more, env=dict(os.environ, **environment))

    def test_runs_resumes_and_reports(self):
        first = self.study()
        self.assertEqual(first.returncode, 0, first.stderr)
        self.assertIn("[1/", first.stdout)
        self.assertIn(" left", first.stdout)
        self.assertIn("1 of 7 points without result", first.stdout)
        study = json.loads((self.dir / "out/study.json").read_text())
        points = {(p["curve"], p.get("spacing")): p for p in study["points"]}
        good = points["standard", 0.1]
        self.assertEqual(good["exit_code"], 0)
        self.assertEqual(good["particles"], 64)
        self.assertGreater(good["core_seconds"], 0)
        summary = json.loads((self.dir / "out/points" / good["folder"] / "run/summary.json").read_text())
        self.assertEqual(good["pairs"], summary["pairs"])
        self.assertEqual(good["scene_hash"], summary["scene_hash"])
        # A point that cannot be run is recorded and stops nothing; the base is the same scene as a point of the grid, run once.
        bad = next(p for p in study["points"] if p["curve"] == "does not fill")
        self.assertEqual(bad["exit_code"], 2)
        self.assertIn("whole", bad["message"])
        base = next(p for p in study["points"] if p["curve"] == "base")
        self.assertEqual(base["folder"], good["folder"])
        mixed = next(p for p in study["points"] if p["curve"] == "mixed")
        self.assertAlmostEqual(mixed["against_base"]["work"], 1.0, places=2)
        # Work is in pairs of the one-pass scheme: those of a scheme of two passes weigh more.
        for p in (points["seed", 0.1], good, mixed):
            price = p["work"] / p["pairs"]
            if p["curve"] == "seed":
                self.assertEqual(price, 1)
            else:
                self.assertGreater(price, 1.1)
                self.assertLess(price, 2)
        self.assertEqual(len((self.dir / "out/study.csv").read_text().splitlines()), 8)
        for curve in study["curves"]:
            self.assertIn("three resolutions", curve["run-out"]["no_extrapolation"])

        # Again: nothing is run, the results are the same to the byte.
        before = (self.dir / "out/study.json").read_bytes()
        second = self.study()
        self.assertIn("6 already there, 0 to run", second.stdout)
        self.assertEqual((self.dir / "out/study.json").read_bytes(), before)
        # A point that was not finished, and one whose scene changed, are run again; the others are not.
        (self.dir / "out/points" / mixed["folder"] / "point.json").unlink()
        self.assertIn("5 already there, 1 to run", self.study().stdout)
        (self.dir / "block.toml").write_text(SCENE.replace("25.0", "26.0"))
        self.assertIn("0 already there, 6 to run", self.study("--max-minutes", "1e-9").stdout)

    def test_figures_and_what_is_said_without_gnuplot(self):
        bare = self.dir / "bin"
        bare.mkdir()
        for folder in os.environ["PATH"].split(":"):  # all but gnuplot: MPI starts programs of its own
            for file in Path(folder).glob("*"):
                if not file.name.startswith("gnuplot") and not (bare / file.name).is_symlink():
                    (bare / file.name).symlink_to(file)
        done = self.study(PATH=str(bare))
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("gnuplot is not installed", done.stdout)
        figures = self.dir / "out/figures"
        self.assertTrue((figures / "figures.gp").exists())
        self.assertTrue((figures / "choices.dat").exists())
        self.assertFalse((figures / "choices.png").exists())
        if shutil.which("gnuplot"):
            self.assertIn("figures in", self.study().stdout)
            for name in ("error_profile", "choices"):
                self.assertGreater((figures / f"{name}.png").stat().st_size, 5000)
                self.assertIn("<svg", (figures / f"{name}.svg").read_text())

    def test_bad_input(self):
        (self.dir / "sweep.toml").write_text(SWEEP.replace('"space.spacing" = [', '"space.spacin" = ['))
        bad = self.study()
        self.assertEqual(bad.returncode, 2)
        self.assertIn('did you mean "space.spacing"', bad.stderr)
        self.assertFalse((self.dir / "out").exists())
        (self.dir / "sweep.toml").write_text(SWEEP)
        (self.dir / "block.toml").write_text(SCENE.replace("young", "yuong"))
        bad = self.study()
        self.assertEqual(bad.returncode, 2)
        self.assertIn("yuong", bad.stderr)
        (self.dir / "block.toml").write_text(SCENE)
        (self.dir / "out").mkdir()
        (self.dir / "out/mine.txt").write_text("not a study's")
        bad = self.study()
        self.assertEqual(bad.returncode, 2)
        self.assertIn("found one with other things in it", bad.stderr)

    def stop(self, when):
        """A study that is asked to stop once it has such a file says that it goes on from there."""
        code, output, _ = Runs(str(self.dir)).stop(("study", "sweep.toml"), "out", lambda there: list(Path(there).glob(when)))
        self.assertEqual(code, 5, output)
        self.assertIn("goes on from here", output)

    def test_a_stop_is_passed_on_and_the_study_goes_on_later(self):
        (self.dir / "block.toml").write_text(SCENE.replace("end = 0.15", "end = 600.0"))
        self.stop("points/*/run/history.csv")

    def test_a_stop_between_two_points_is_heard_too(self):
        self.stop("points/*/point.json")

    def test_twins_give_error_bars_and_change_no_bit(self):
        plain = kuzure("run", self.dir / "block.toml", "-o", self.dir / "plain", "--quiet", "--threads", 1, "--set", "space.spacing=0.05")
        self.assertEqual(plain.returncode, 0, plain.stderr)
        twins = kuzure("run", self.dir / "block.toml", "-o", self.dir / "twins", "--twins", "--threads", 1, "--set", "space.spacing=0.05")
        self.assertEqual(twins.returncode, 0, twins.stderr)
        a, b = (json.loads((self.dir / d / "summary.json").read_text()) for d in ("plain", "twins"))
        self.assertEqual(a["state_hash"], b["state_hash"])
        self.assertNotIn("error_bars", a)
        bars = b["error_bars"]
        self.assertEqual([(t["factor"], t["soil_particles"]) for t in bars["twins"]], [(4, 16), (2, 64)])
        for name in ("run-out", "height", "peak speed"):
            self.assertIn(name, twins.stdout)
            if bars[name]["half_width"] is None:
                self.assertTrue(bars[name]["no_interval"])
            else:
                self.assertGreaterEqual(bars[name]["half_width"], 0)
        for factor in (4, 2):
            self.assertTrue((self.dir / f"twins/twins/x{factor}/summary.json").exists())
        # A scene whose twins cannot be filled runs all the same, and says why it has no error bars.
        thin = kuzure(
            "run",
            self.dir / "block.toml",
            "-o",
            self.dir / "thin",
            "--twins",
            "--set",
            "body.0.box.high=[0.8,0.0,0.1]",
            "--set",
            "time.end=0.01",
        )
        self.assertEqual(thin.returncode, 0, thin.stderr)
        self.assertIn("the twin of 4 times the spacing failed", thin.stdout)
        self.assertIn("no interval", thin.stdout)

    def test_the_dial(self):
        done = kuzure("check", self.dir / "block.toml", "--accuracy", "10%")
        self.assertEqual(done.returncode, 0, done.stderr)
        for word in ("preset = ", "spacing = ", "expected error", "rests on"):
            self.assertIn(word, done.stdout)
        proposal = json.loads(kuzure("check", self.dir / "block.toml", "--accuracy", "10%", "--json").stdout)
        self.assertLessEqual(proposal["expected_error"], 0.1)
        self.assertLessEqual(proposal["error_interval"][0], proposal["error_interval"][1])
        # What is proposed is accepted.
        sets = ["--set", f"space.spacing={proposal['spacing']}", "--set", f"accuracy.preset={proposal['preset']}"]
        self.assertEqual(kuzure("check", self.dir / "block.toml", *sets).returncode, 0)
        self.assertEqual(kuzure("check", self.dir / "block.toml", "--accuracy", "lots").returncode, 2)


if __name__ == "__main__":
    unittest.main(argv=sys.argv[:1], verbosity=2)
