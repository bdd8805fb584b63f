"""What the fault tests share: a place of their own, a small scene, starting kuzure and finding all of its processes, and
what a run has left. Nothing here is a test."""
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time

import h5py
import numpy as np

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import block, check, finish, legs, program, wait_for  # the last ones for those who take all from here


# The law of equal bits lets any run here be compared with any other by its hash.
def scene_text(end=0.02, every=0.005, checkpoint=30.0):
    return block(
        (0.32, 0.24, 0.24),
        ((-0.4, -0.4, -0.16), (1.2, 0.64, 0)),
        title="a block of wet sand thrown across the floor",
        end=end,
        soil="cohesion = 1000.0",
        body="velocity = [2.0, 0.5, 0.0]",
        effects='viscosity = { alpha = 0.1 }\nartificial_stress = "auto"',
        accuracy="skin = 0.05",
        output=f"history = 0.0005\nevery = {every}\ncheckpoint_minutes = {checkpoint}",
    )


class Place:
    """A directory that goes in the end. MPI keeps its own files there too, so that what a kill leaves goes with it."""

    def __init__(self, name):
        self.path = tempfile.mkdtemp(prefix=f"kuzure-{name}-")
        mpi = os.path.join(self.path, "mpi")
        os.mkdir(mpi)
        self.environment = {
            **os.environ,
            "OMPI_MCA_orte_tmpdir_base": mpi,
            "OMPI_MCA_btl_vader_backing_directory": mpi,
            "OMP_NUM_THREADS": "1",
        }
        self.mounted = []

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for there in self.mounted:
            subprocess.run(["umount", "-l", there])
        shutil.rmtree(self.path, ignore_errors=True)

    def __call__(self, *names):
        return os.path.join(self.path, *names)

    def write(self, name, text):
        with open(self(name), "w") as f:
            f.write(text)
        return self(name)

    def small_disk(self, name, megabytes, options=""):
        """A disk of that size, or None where this user may not mount one."""
        there = self(name)
        os.mkdir(there)
        done = subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={int(megabytes * 1024)}k{options}", "none", there], capture_output=True)
        if done.returncode != 0:
            print("skipped: this user may not mount a small disk", flush=True)
            return None
        self.mounted.append(there)
        return there

    def command(self, scene, out, *more, ranks=1):
        mpi = ["mpirun", "-n", str(ranks)] if ranks > 1 else []
        return [*mpi, program, "run", scene, "-o", self(out), "--threads", "1", *more]

    def run(self, scene, out, *more, ranks=1, expect=0, timeout=300):
        done = subprocess.run(
            self.command(scene, out, *more, ranks=ranks),
            capture_output=True,
            text=True,
            timeout=timeout,
            env=self.environment,
            cwd=self.path,
        )
        expected = expect if isinstance(expect, (tuple, list)) else (expect,)
        check(
            done.returncode in expected,
            f"{os.path.basename(out)} {' '.join(more)} on {ranks}: exit {done.returncode}, expected {expect} {done.stderr.strip()[-300:]}",
        )
        return done

    def start(self, scene, out, *more, ranks=1, said=None):
        # What is said goes to a file: a pipe that nobody reads would stop the ranks.
        said = open(self(said or os.path.basename(out) + ".said"), "w")
        return subprocess.Popen(
            self.command(scene, out, *more, ranks=ranks),
            stdout=said,
            stderr=said,
            env=self.environment,
            cwd=self.path,
            start_new_session=True,
        )

    def summary(self, out):
        with open(self(out, "summary.json")) as f:
            return json.load(f)

    def processes(self, out):
        """[(pid, is a rank)] of all processes that work on a result directory, mpirun among them."""
        found = []
        for entry in os.listdir("/proc"):
            if not entry.isdigit() or int(entry) == os.getpid():
                continue
            try:
                with open(f"/proc/{entry}/cmdline", "rb") as f:
                    words = f.read().decode(errors="replace").split("\0")
                with open(f"/proc/{entry}/stat") as f:
                    state = f.read().rsplit(")", 1)[1].split()[0]
            except (FileNotFoundError, ProcessLookupError):
                continue
            if self(out) in words and state not in "ZX":
                found.append((int(entry), os.path.basename(words[0]) == os.path.basename(program)))
        return found

    def gone(self, out, seconds=20):
        """Waits until no process works on the directory any more; ends those that stay (mpirun killed, a rank may linger)."""
        end = time.monotonic() + seconds
        while (left := self.processes(out)) and time.monotonic() < end:
            time.sleep(0.05)
        for pid, _ in left:
            kill(pid, signal.SIGKILL)
        while self.processes(out):
            time.sleep(0.05)
        return not left


def kill(pid, number):
    try:
        os.kill(pid, number)
        return True
    except ProcessLookupError:
        return False


def history(path):
    with open(os.path.join(path, "history.csv")) as f:
        return f.read().splitlines()[2:]


def snapshots(path):
    """[(time, sum over the state)] of the snapshots that the series names."""
    with open(os.path.join(path, "snapshots", "state.hdf.series")) as f:
        files = json.load(f)["files"]
    rows = []
    for entry in files:
        with h5py.File(os.path.join(path, "snapshots", entry["name"])) as f:
            data = f["VTKHDF/PointData"]
            order = np.argsort(data["id"][:])
            rows.append((entry["time"], f["VTKHDF/Points"][:][order].tobytes(), *(data[k][:][order].tobytes() for k in sorted(data))))
    return rows


def same_results(place, out, reference, name):
    """All that a run leaves for its reader is that of the undisturbed one, to the bit."""
    a, b = place.summary(out), place.summary(reference)
    good = check(a["state_hash"] == b["state_hash"], f"{name}: state_hash {a['state_hash']} is that of the undisturbed run")
    good &= check(a["pairs"] == b["pairs"] and a["energy"] == b["energy"], f"{name}: pairs and energies are those of the undisturbed run")
    good &= check(history(place(out)) == history(place(reference)), f"{name}: history.csv has no row doubled, missing or changed")
    good &= check(snapshots(place(out)) == snapshots(place(reference)), f"{name}: the snapshots are those of the undisturbed run")
    left = [f for f in os.listdir(place(out)) + os.listdir(place(out, "snapshots")) if f.endswith(".tmp")]
    good &= check(not left, f"{name}: no half-written file is left {left}")
    return good
