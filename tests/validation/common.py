"""What every validation script needs: scenes, runs that are not repeated, snapshots, profiles, records, figures.

Environment: KUZURE (program; default build/release/kuzure), KUZURE_RESULTS (records, curves and runs; default
results/validation), KUZURE_FIGURES (default $KUZURE_RESULTS/figures), KUZURE_THREADS (default 1).
Only numpy, h5py and the gnuplot program are needed, all from Debian.
"""
import copy
import hashlib
import json
import os
import shutil
import subprocess
import sys

import numpy as np

from known import MISSES

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
sys.path.insert(0, os.path.join(ROOT, "python"))
import kuzure
from kuzure.tables import read_table

PROGRAM = os.path.abspath(os.environ.get("KUZURE", os.path.join(ROOT, "build", "release", "kuzure")))
RESULTS = os.path.abspath(os.environ.get("KUZURE_RESULTS", os.path.join(ROOT, "results", "validation")))
FIGURES = os.path.abspath(os.environ.get("KUZURE_FIGURES", os.path.join(RESULTS, "figures")))
THREADS = os.environ.get("KUZURE_THREADS", "1")
GRAVITY = 9.81  # m/s^2
CLOSING = 0.05  # how near an independent number must be to close a gate that is missed


# ---------------------------------------------------------------------------------------------- scenes
def rounded(v):
    """Numbers without the last digits in which 3 * 0.1 differs from 0.3, in whatever they stand."""
    if isinstance(v, dict):
        return {k: rounded(x) for k, x in v.items()}
    if isinstance(v, (list, tuple)):
        return [rounded(x) for x in v]
    return round(float(v), 12) if isinstance(v, (float, np.floating)) else v


def toml(scene):
    """Text of a scene given as nested dicts: `soil` holds named soils, `body` and `wall` are lists."""
    return kuzure.to_toml(rounded(scene))


def changed(scene, changes):
    """A copy of the scene with {"section.key": value}; the value None takes the key away; body/wall/soil take the only or first one."""
    out = copy.deepcopy(scene)
    for path, value in changes.items():
        *sections, key = path.split(".")
        table = out
        for s in sections:
            table = table.setdefault(s, {})
            if s in ("body", "wall"):
                table = table[0]
            elif s == "soil":
                table = next(iter(table.values()))
        if value is None:
            table.pop(key, None)
        else:
            table[key] = value
    return out


# ---------------------------------------------------------------------------------------------- runs
_fingerprint = None


def program_fingerprint():
    """Of the program's bytes: two builds of one version may differ."""
    global _fingerprint
    if _fingerprint is None:
        with open(PROGRAM, "rb") as f:
            _fingerprint = hashlib.sha256(f.read()).hexdigest()
    return _fingerprint


def accepted(scene):
    """(True, "") if `kuzure check` takes the scene, else (False, why): effects that are not built yet are refused, not ignored."""
    os.makedirs(RESULTS, exist_ok=True)
    file = os.path.join(RESULTS, f"check-{os.getpid()}.toml")
    with open(file, "w") as f:
        f.write(toml(scene))
    done = subprocess.run([PROGRAM, "check", file], capture_output=True, text=True)
    os.remove(file)
    return done.returncode == 0, done.stderr.strip()


class RunFailed(Exception):
    pass


class Run(kuzure.Run):
    """A finished run: its summary, history and snapshots."""

    @property
    def seconds(self):
        return self.summary["wall_seconds"]

    @property
    def history(self):
        return read_table(self.directory / "history.csv")  # arrays, with pandas or without


def run(scene, case, name, minutes=8.0, fresh=False):
    """Run a scene in $KUZURE_RESULTS/runs/<case>/<name>, or take what is there if the same program already ran the same scene."""
    text = toml(scene)
    key = hashlib.sha256((program_fingerprint() + text).encode()).hexdigest()
    folder = os.path.join(RESULTS, "runs", case)
    out = os.path.join(folder, name)
    stamp = os.path.join(folder, name + ".key")
    if not fresh and os.path.exists(stamp) and os.path.exists(os.path.join(out, "summary.json")):
        with open(stamp) as f:
            if f.read() == key and (old := Run(out)).summary["exit_code"] == 0:
                return old
    os.makedirs(folder, exist_ok=True)
    file = os.path.join(folder, name + ".toml")
    with open(file, "w") as f:
        f.write(text)
    shutil.rmtree(out, ignore_errors=True)
    if os.path.exists(stamp):
        os.remove(stamp)
    command = [PROGRAM, "run", file, "-o", out, "--threads", THREADS, "--max-minutes", str(minutes), "--quiet"]
    environment = dict(os.environ, OMPI_ALLOW_RUN_AS_ROOT="1", OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1")
    done = subprocess.run(command, capture_output=True, text=True, timeout=60 * minutes + 120, env=environment)
    if done.returncode != 0:
        raise RunFailed(f"{case}/{name}: exit {done.returncode}: {done.stderr.strip()[-600:]}")
    with open(stamp, "w") as f:
        f.write(key)
    result = Run(out)
    print(
        f"  {case}/{name}: {result.summary['soil_particles']} particles, {result.summary['steps']} steps, {result.seconds:.1f} s",
        flush=True,
    )
    return result


# ---------------------------------------------------------------------------------------------- measurements
def surface(x, z, dx, at, half_width=None):
    """Height of the free surface at the places `at`: the highest particle within half_width (default one spacing), plus half a spacing. 0 where none is."""
    half = half_width or dx
    order = np.argsort(x)
    xs, zs = x[order], z[order]
    low, high = np.searchsorted(xs, np.asarray(at) - half), np.searchsorted(xs, np.asarray(at) + half)
    return np.array([zs[a:b].max() + 0.5 * dx if b > a else 0.0 for a, b in zip(low, high)])


def thickness(x, dx, at, width):
    """Height by volume of columns `width` wide: each particle counts with the part of its square that lies in the column, so that no count
    jumps as a column moves. Unlike `surface` it does not see single thrown grains."""
    xs = np.sort(x)
    total = np.concatenate([[0.0], np.cumsum(xs)])

    def left_of(q):
        """Area of all squares left of q, over dx^2."""
        low, high = np.searchsorted(xs, q - 0.5 * dx), np.searchsorted(xs, q + 0.5 * dx)
        return low + ((high - low) * (q + 0.5 * dx) - (total[high] - total[low])) / dx

    at = np.asarray(at)
    return (left_of(at + 0.5 * width) - left_of(at - 0.5 * width)) * dx * dx / width


def last_crossing(x, y, level):
    """Outermost x at which the curve y(x) falls through the level; nan where it never does."""
    for k in range(len(x) - 1, 0, -1):
        if y[k] < level <= y[k - 1]:
            return x[k - 1] + (y[k - 1] - level) / (y[k - 1] - y[k]) * (x[k] - x[k - 1])
    return np.nan


def first_crossing(x, y, level):
    """Innermost x at which the curve y(x) falls through the level."""
    for k in range(1, len(x)):
        if y[k] < level <= y[k - 1]:
            return x[k - 1] + (y[k - 1] - level) / (y[k - 1] - y[k]) * (x[k] - x[k - 1])
    return np.nan


def neighbour_pairs(points, reach):
    """Index pairs (i < j) closer than reach, by a grid of cells."""
    cell = np.floor((points - points.min(axis=0)) / reach).astype(np.int64)
    size = cell.max(axis=0) + 3
    stride = np.concatenate([np.cumprod(size[::-1])[::-1][1:], [1]])
    key = (cell + 1) @ stride
    order = np.argsort(key, kind="stable")
    ordered = key[order]
    first, second = [], []
    shifts = np.stack(np.meshgrid(*[[-1, 0, 1]] * points.shape[1], indexing="ij"), -1).reshape(-1, points.shape[1]) @ stride
    for shift in shifts[shifts >= 0]:
        low, high = np.searchsorted(ordered, key + shift, "left"), np.searchsorted(ordered, key + shift, "right")
        count = high - low
        i = np.repeat(np.arange(len(points)), count)
        j = order[np.repeat(low, count) + np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)]
        keep = (i < j) if shift == 0 else np.ones(len(i), bool)
        i, j = i[keep], j[keep]
        close = np.sum((points[i] - points[j]) ** 2, axis=1) < reach * reach
        first.append(i[close]), second.append(j[close])
    return np.concatenate(first), np.concatenate(second)


def components(points, reach):
    """Label of the connected component of each point; points closer than reach are joined."""
    label = np.arange(len(points))
    i, j = neighbour_pairs(points, reach)
    while True:
        low = np.minimum(label[i], label[j])
        new = label.copy()
        np.minimum.at(new, i, low), np.minimum.at(new, j, low)
        new = new[new]
        if np.array_equal(new, label):
            return label
        label = new


def stress_noise(snapshot, dx, rho, component=2):
    """RMS of a stress against its own average over the neighbourhood (2.6 spacings), over max(|average|, rho g dx); full neighbourhoods only."""
    dims = 2 if np.ptp(snapshot["position"][:, 1]) == 0 else 3
    points = snapshot["position"][:, [0, 2]] if dims == 2 else snapshot["position"]
    s = snapshot["stress"][:, component]
    i, j = neighbour_pairs(points, 2.6 * dx)
    w = (1 - np.linalg.norm(points[i] - points[j], axis=1) / (2.6 * dx)) ** 2
    total, weight, count = s.copy(), np.ones(len(s)), np.zeros(len(s))
    np.add.at(total, i, w * s[j]), np.add.at(total, j, w * s[i])
    np.add.at(weight, i, w), np.add.at(weight, j, w)
    np.add.at(count, i, 1), np.add.at(count, j, 1)
    mean = total / weight
    inside = count >= (18 if dims == 2 else 60)
    if not inside.any():
        return np.nan
    return float(np.sqrt(np.mean(((s - mean)[inside] / np.maximum(np.abs(mean[inside]), rho * GRAVITY * dx)) ** 2)))


# ---------------------------------------------------------------------------------------------- records
class Case:
    """The record of one validation case: JSON lines in $KUZURE_RESULTS/<case>.jsonl, begun anew each time."""

    def __init__(self, name):
        self.name = name
        self.failed = []  # gates missed
        self.surprises = []  # gates missed that known.py does not know, or met that it says are missed
        os.makedirs(RESULTS, exist_ok=True)
        self.file = os.path.join(RESULTS, name + ".jsonl")
        open(self.file, "w").close()
        print(name, flush=True)

    def record(self, what, reference, result, unit="1", tolerance="", passed=None, seconds=0.0, note="", figure="", independent=None):
        """passed None: a number for information, no gate. independent: the number of another code or a closed form and whose it is; a gate
        that is missed is closed where the result is within 5 % of it."""
        closed = ""
        if passed is not None and not passed and independent and abs(result / independent[0] - 1) <= CLOSING:
            closed = f"{independent[1]}: {independent[0]:.4g}"
        if isinstance(result, (float, np.floating)):
            result = float(f"{float(result):.5g}") if np.isfinite(result) else None
        row = {
            "case": self.name,
            "what": what,
            "reference": reference,
            "result": result,
            "unit": unit,
            "tolerance": tolerance,
            "passed": None if passed is None else bool(passed),
            "seconds": round(float(seconds), 2),
            "note": note,
            "figure": figure,
            "closed": closed,
        }
        with open(self.file, "a") as f:
            f.write(json.dumps(row) + "\n")
        mark = "closed " if closed else {None: "      ", True: "ok    ", False: "FAIL  "}[row["passed"]]
        print(f"{mark}{what}: {result} {unit} (reference {reference}, {tolerance or 'no gate'}) {note} {closed}".rstrip(), flush=True)
        known, good = (self.name, what) in MISSES, row["passed"] or bool(closed)
        if row["passed"] is not None and not good:
            self.failed.append(what)
        if row["passed"] is not None and good == known:
            self.surprises.append(what + (": met, although known.py says it is missed" if known else ": missed"))

    def within(self, what, reference, result, unit, percent, **more):
        """A gate: result within +- percent of the reference."""
        good = bool(np.isfinite(result)) and abs(result - reference) <= abs(reference) * percent / 100
        self.record(what, reference, result, unit, f"+-{percent:g} %", good, **more)
        return good

    def control(self, what, rejected, result, unit="1", **more):
        """A negative control: a run known to be wrong, which the gates have to reject."""
        self.record("control: " + what, "rejected", result, unit, "gate must fail", rejected, **more)

    def curve(self, name, **columns):
        """Columns as $KUZURE_RESULTS/<case>-<name>.csv."""
        file = os.path.join(RESULTS, f"{self.name}-{name}.csv")
        names = list(columns)
        np.savetxt(file, np.column_stack([columns[n] for n in names]), delimiter=",", fmt="%.6g", header=",".join(names), comments="")
        return file

    def done(self):
        """Exit status of the script: 1 if a gate was missed, or, with KUZURE_KNOWN=1, if that was not known before."""
        print(f"{self.name}: {len(self.failed)} missed" + "".join("\n  " + f for f in self.failed), flush=True)
        if os.environ.get("KUZURE_KNOWN") == "1":
            print(f"{self.name}: {len(self.surprises)} surprises" + "".join("\n  " + f for f in self.surprises), flush=True)
            return 1 if self.surprises else 0
        return 1 if self.failed else 0


# ---------------------------------------------------------------------------------------------- figures
def figure(name, commands, size=(840, 520), svg=True):
    """Draw gnuplot commands as <figures>/<name>.png and, for line drawings, .svg. Returns the name of the PNG."""
    os.makedirs(FIGURES, exist_ok=True)
    head = """set datafile separator ','
set border 3 lc rgb '#404040'; set tics nomirror out textcolor rgb '#404040'; set grid lc rgb '#e4e4e4' lw 1
set key Left reverse samplen 2 spacing 1.15
"""
    # Thousands of particles: without smoothed edges, a third of the bytes.
    smooth, font = ("pngcairo", "DejaVu Sans,11") if svg else ("png", "DejaVuSans,10")
    terminals = [("png", f"set terminal {smooth} size {size[0]},{size[1]} font '{font}'{' lw 1.3' if svg else ''}\n")]
    if svg:
        terminals.append(("svg", f"set terminal svg size {size[0]},{size[1]} font 'DejaVu Sans,13' lw 1.3 background rgb 'white'\n"))
    for ending, terminal in terminals:
        file = os.path.join(FIGURES, f"{name}.{ending}")
        done = subprocess.run(["gnuplot"], input=terminal + f"set output '{file}'\n" + head + commands, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"gnuplot, {name}: {done.stderr.strip()[-800:]}")
    return name + ".png"


COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000"]  # Okabe and Ito: tell apart without red and green
