"""Runs of the program in a test's own directory, and what they leave. Nothing here is a test."""
import csv
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import time

from harness import check, finish, legs, program, wait_for


def run_parts(*parts):
    """The main() of a test of several parts: those that the command line names, or all."""
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    for part in [p for p in parts if not sys.argv[2:] or p.__name__ in sys.argv[2:]]:
        print(f"# {part.__name__}", flush=True)
        part()
    finish()


def value(x):
    try:
        return float(x)
    except ValueError:
        return x


def check_shell(script, what):
    """The script is sound shell."""
    done = subprocess.run(["bash", "-n", script], capture_output=True, text=True)
    check(done.returncode == 0, f"{what}: bash -n {done.stderr}")
    if shutil.which("shellcheck"):
        done = subprocess.run(["shellcheck", "-S", "warning", script], capture_output=True, text=True)
        check(done.returncode == 0, f"{what}: shellcheck {done.stdout}")


def has_child(pid):
    try:
        with open(f"/proc/{pid}/task/{pid}/children") as f:
            return bool(f.read().strip())
    except OSError:
        return True  # it has ended, or this system does not tell


class Runs:
    """Scenes and result directories in one directory, by name."""

    def __init__(self, work):
        self.work = work

    def path(self, *parts):
        return os.path.join(self.work, *parts)

    def write(self, name, text, executable=False):
        os.makedirs(os.path.dirname(self.path(name)), exist_ok=True)
        with open(self.path(name), "w") as f:
            f.write(text)
        if executable:
            os.chmod(self.path(name), 0o755)
        return self.path(name)

    def read(self, *name):
        """The text of a file; none where there is no such file."""
        try:
            with open(self.path(*name)) as f:
                return f.read()
        except FileNotFoundError:
            return ""

    def scene(self, name, text):
        return self.write(name + ".toml", text)

    def call(self, *args, expect=0, says=(), timeout=600):
        """The program in this directory."""
        done = subprocess.run([program, *args], capture_output=True, text=True, timeout=timeout, cwd=self.work)
        good = done.returncode == expect and all(word in done.stderr for word in says)
        check(good, f"{' '.join(args)[-100:]}: exit {done.returncode}, expected {expect} {'' if good else done.stderr.strip()[-400:]}")
        return done

    def kill(self, args, times, least, most, seed, signals=(signal.SIGKILL,)):
        """Starts the program so often, and sends it these signals in turn: after a random time from `least` to `most` seconds, or every
        other time as soon as it has started a run of its own, which then outlives it for a moment. Gives the exit codes."""
        moments, codes = random.Random(seed), []
        for k in range(times):
            half = subprocess.Popen([program, *args], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, cwd=self.work)
            end = time.monotonic() + moments.uniform(least, most)
            while time.monotonic() < end and not (k % 2 and has_child(half.pid)):
                time.sleep(0.002)
            half.send_signal(signals[k % len(signals)])
            codes.append(half.wait())
        return codes

    def stop(self, args, out, ready, tries=20):
        """Starts the program with -o, and sends it SIGTERM as soon as ready(directory): the exit code, what it said, and the directory. Where
        it has come to its end before it heard that, again in another directory: this process may have been away for any time."""
        for k in range(tries):
            there = f"{out}{k or ''}"
            with open(self.path(there + ".said"), "w") as said:
                process = subprocess.Popen([program, *args, "-o", there], stdout=said, stderr=said, cwd=self.work)
                wait_for(lambda: ready(self.path(there)), every=0.001, process=process)
                process.send_signal(signal.SIGTERM)
                code = process.wait(300)
            if code != 0:
                break
        return code, self.read(there + ".said"), there

    def in_legs(self, path, out, seconds):
        """A run that took `seconds` in one go, in legs that the clock ends, on one rank and on two in turn: the summary after each."""
        ends = []
        for minutes in legs(seconds):
            done = self.run(path, out, 1 + len(ends) % 2, extra=["--restart", "--max-minutes", minutes], expect=None)
            ends.append(json.loads(self.read(out, "summary.json") or "{}"))  # none where it was stopped while the soil settled
            if done.returncode != 5:
                check(done.returncode == 0, f"{out}: leg {len(ends)} ends with exit {done.returncode} {done.stderr.strip()[-400:]}")
                break
        return ends

    def run(self, path, out, ranks=1, threads=1, extra=(), expect=0):
        command = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
        command += [program, "run", path, "-o", self.path(out), "--threads", str(threads), *extra]
        done = subprocess.run(command, capture_output=True, text=True, timeout=300)
        if expect is not None:
            check(done.returncode == expect, f"{out}: exit {done.returncode}, expected {expect} {done.stderr.strip()[-400:]}")
        return done

    def json(self, *name):
        with open(self.path(*name)) as f:
            return json.load(f)

    def summary(self, out):
        return self.json(out, "summary.json")

    def raw(self, out, name):
        with open(self.path(out, name), "rb") as f:
            return f.read()

    def table(self, out, name):
        """Rows of a table as dicts, numbers where they are some."""
        with open(self.path(out, name)) as f:
            rows = [r for r in csv.DictReader(f) if not next(iter(r.values())).startswith("#")]
        return [{k: value(x) for k, x in r.items()} for r in rows]

    def unaccounted(self, out):
        """Of each row of the history, the energy that came from nowhere since the start, J; and the largest energy of the run, what moving walls and loads gave too."""
        rows = self.table(out, "history.csv")
        accounts = "kinetic potential elastic plastic viscous wall damping stabilising moved_wall events loads".split()
        sums = [sum(r[k] for k in accounts) for r in rows]
        largest = max(max(r["kinetic"] + r["elastic"] + max(-r["potential"], 0), abs(r["moved_wall"]), abs(r["loads"])) for r in rows)
        return [s - sums[0] for s in sums], largest

    def refused(self, scenes):
        """Each of {what: (text of a scene, words of the message)} is refused with exit code 2 and leaves nothing."""
        for name, (text, words) in scenes.items():
            done = self.run(self.scene("wrong", text), "wrong", expect=2)
            check(words in done.stderr, f"{name}: {words}" + ("" if words in done.stderr else f": {done.stderr.strip()[-300:]}"))
            check(not os.path.exists(self.path("wrong")), f"{name}: nothing is written")
