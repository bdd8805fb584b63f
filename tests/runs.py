"""Runs of the program in a test's own directory, and what they leave. Nothing here is a test."""
import csv
import json
import os
import subprocess

from harness import check, program


def value(x):
    try:
        return float(x)
    except ValueError:
        return x


class Runs:
    """Scenes and result directories in one directory, by name."""

    def __init__(self, work):
        self.work = work

    def path(self, *parts):
        return os.path.join(self.work, *parts)

    def scene(self, name, text):
        with open(self.path(name + ".toml"), "w") as f:
            f.write(text)
        return self.path(name + ".toml")

    def run(self, path, out, ranks=1, threads=1, extra=(), expect=0):
        command = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
        command += [program, "run", path, "-o", self.path(out), "--threads", str(threads), *extra]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300)
        if expect is not None:
            check(done.returncode == expect, f"{out}: exit {done.returncode}, expected {expect} {done.stderr.strip()[-400:]}")
        return done

    def summary(self, out):
        with open(self.path(out, "summary.json")) as f:
            return json.load(f)

    def raw(self, out, name):
        with open(self.path(out, name), "rb") as f:
            return f.read()

    def table(self, out, name):
        """Rows of a table as dicts, numbers where they are some."""
        with open(self.path(out, name)) as f:
            rows = [r for r in csv.DictReader(f) if not next(iter(r.values())).startswith("#")]
        return [{k: value(x) for k, x in r.items()} for r in rows]

    def unaccounted(self, out):
        """Of each row of the history, the energy that came from nowhere since the start, J; and the largest energy of the run, that moving walls gave too."""
        rows = self.table(out, "history.csv")
        accounts = "kinetic potential elastic plastic viscous wall damping stabilising moved_wall events".split()
        sums = [sum(r[k] for k in accounts) for r in rows]
        largest = max(max(r["kinetic"] + r["elastic"] + max(-r["potential"], 0), abs(r["moved_wall"])) for r in rows)
        return [s - sums[0] for s in sums], largest

    def refused(self, scenes):
        """Each of {what: (text of a scene, words of the message)} is refused with exit code 2 and leaves nothing."""
        for name, (text, words) in scenes.items():
            done = self.run(self.scene("wrong", text), "wrong", expect=2)
            check(words in done.stderr, f"{name}: {words}" + ("" if words in done.stderr else f": {done.stderr.strip()[-300:]}"))
            check(not os.path.exists(self.path("wrong")), f"{name}: nothing is written")
