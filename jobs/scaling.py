#!/usr/bin/python3
"""Strong and weak scaling: runs the points of a scaling file here, or as batch jobs, and reports where the efficiency goes.

  jobs/scaling.py SCALING.toml                            every point that fits the cores of this host, repeats in turn
  jobs/scaling.py SCALING.toml --quick                    the same with the smaller settings of its table [quick]
  jobs/scaling.py SCALING.toml --machine NAME             batch scripts by `kuzure job`, one a point; report of what has finished
  jobs/scaling.py SCALING.toml --machine NAME --submit    and hand them to the batch system

Finished points are not run again: call it again after an interruption, or when batch jobs have ended. Leaves in DIR (default
results/scaling/NAME): points.csv, report.md, efficiency.svg/png, losses.svg/png, and every run's own directory.
Exit codes as kuzure's: 0, 2 the file is wrong, 3 layouts of the same soil ended with different bits, 4 a run failed."""
# Beyond 400 lines: one tool that runs from a checkout without anything beside it.
import argparse
import csv
import difflib
import json
import os
import re
import shutil
import subprocess
import sys
import tomllib

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))

# What a core's time goes to, by the phases of timers.json. What is not named (other) is kernel's: the step's own small work.
GROUPS = {
    "kernel": ["interior pairs", "rim pairs", "move", "guard", "other"],
    "lists": ["sort", "lists"],
    "imbalance": [],  # taken out of the waits below: what the slowest rank computes longer than the mean
    "halo": ["begin halo", "wait for halo", "ghosts"],
    "migration": ["migrate"],
    "re-cut": ["partition"],
    "reductions": ["reduce"],
    "I/O": ["snapshot", "history", "maps", "checkpoint", "picture"],
}
COMPUTES = ["interior pairs", "rim pairs", "move"]
COLOURS = ["#0072b2", "#56b4e9", "#d55e00", "#e69f00", "#009e73", "#cc79a7", "#f0e442", "#888888"]


class Wrong(Exception):
    pass


# ---------------------------------------------------------------------------------------------- the scaling file
KEYS = {
    "": ["title", "kind", "repeats", "steps_per_output", "set", "here", "machine", "quick", "case"],
    "here": ["layouts", "threads"],
    "machine": ["nodes"],
    "quick": ["repeats", "set"],
    "case": ["series", "scene", "share", "tiles", "set"],
}


NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.+-]*")  # of series: it becomes directories, figures' labels and jobs' names


def kinds(check, what):
    return lambda v: (check(v), what)


whole = kinds(lambda v: type(v) is int and 1 <= v <= 10**6, "a whole number from 1 to 1e6")
text = kinds(lambda v: isinstance(v, str) and v.isprintable(), "a string of one line")
texts = kinds(lambda v: isinstance(v, list) and all(isinstance(x, str) and x.isprintable() for x in v), "an array of strings of one line")
wholes = lambda v, n: isinstance(v, list) and all(whole(x)[0] for x in v) and (n is None or len(v) == n)
table = kinds(lambda v: isinstance(v, dict), "a table")
# What the value of each key must be.
VALUES = {
    "title": text,
    "kind": text,
    "scene": text,
    "set": texts,
    "repeats": whole,
    "steps_per_output": whole,
    "share": whole,
    "threads": whole,
    "series": kinds(
        lambda v: isinstance(v, str) and NAME.fullmatch(v) and len(v) <= 60,
        "a name of letters, digits and _ . + -, beginning with one of the first two",
    ),
    "tiles": kinds(lambda v: wholes(v, 2), "two whole numbers from 1"),
    "nodes": kinds(lambda v: wholes(v, None) and v, "an array of whole numbers from 1"),
    "layouts": kinds(lambda v: isinstance(v, list) and v and all(wholes(x, 2) for x in v), "an array of [ranks, threads]"),
    "here": table,
    "machine": table,
    "quick": table,
    "case": kinds(lambda v: isinstance(v, list) and all(isinstance(x, dict) for x in v), "tables [[case]]"),
}


def in_gnuplot(words):
    """A string of gnuplot in single quotes: in double ones a backtick would run a command."""
    return "'" + "".join(c if c.isprintable() else " " for c in words).replace("'", "''") + "'"


def read_plan(path):
    try:
        with open(path, "rb") as f:
            plan = tomllib.load(f)
    except (OSError, tomllib.TOMLDecodeError) as e:
        raise Wrong(f"{path}: expected a scaling file: {e}")

    def check(table, where):
        for key in table:
            if key not in KEYS[where]:
                near = difflib.get_close_matches(key, KEYS[where], 1)
                line = next((k for k, text in enumerate(open(path), 1) if text.strip().startswith(key)), 1)
                meant = f'; did you mean "{near[0]}"?' if near else "."
                raise Wrong(f'{path}:{line}: {key}: expected a known key, found "{key}"{meant} Known here: {", ".join(KEYS[where])}')
            good, what = VALUES[key](table[key])
            if not good:
                raise Wrong(f"{path}: {where + '.' if where else ''}{key}: expected {what}, found {table[key]!r:.60}")

    check(plan, "")
    for where in ("here", "machine", "quick"):
        check(plan.get(where, {}), where)
    if plan.get("kind") not in ("strong", "weak"):
        raise Wrong(f'{path}: kind: expected "strong" or "weak", found {plan.get("kind")!r}')
    if "title" not in plan:
        raise Wrong(f'{path}: title: expected title = "...", found nothing')
    if not plan.get("case"):
        raise Wrong(f"{path}: case: expected [[case]] with scene, found nothing")
    for case in plan["case"]:
        check(case, "case")
        if "scene" not in case:
            raise Wrong(f'{path}: case: expected scene = "path", found {case}')
        case["scene"] = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(path)), case["scene"]))
        if not os.path.exists(case["scene"]):
            raise Wrong(f"{path}: case: scene: found no file {case['scene']}")
        case.setdefault("series", os.path.splitext(os.path.basename(case["scene"]))[0])
        if not NAME.fullmatch(case["series"]):
            raise Wrong(
                f'{path}: case: series: the name of the scene file, {case["series"]!r}, is no name for directories; give series = "..."'
            )
        if plan["kind"] == "weak" and "share" not in case:
            raise Wrong(f"{path}: case: share: expected the number of ranks of this case, found nothing")
    return plan


def submit_command(profile_path, batch):
    """By which a script is handed to a batch system: its template, beside the profile or in jobs/machines, says so."""
    for folder in (os.path.dirname(profile_path) or ".", os.path.join(ROOT, "jobs/machines")):
        template = os.path.join(folder, f"{batch}.job.sh")
        if os.path.exists(template):
            with open(template) as f:
                said = re.search(r"^## submit: (\S+)$", f.read(), re.M)
            if not said:
                raise Wrong(f'{template}: expected a line "## submit: COMMAND", found none; write by what a script is submitted')
            return said[1]
    raise Wrong(f"{profile_path}: batch: expected a batch system with a template {batch}.job.sh beside the profile, found none")


def widened(scene, tiles):
    """--set values that repeat the first body and its floor sideways."""
    with open(scene, "rb") as f:
        s = tomllib.load(f)
    body, wall = s["body"][0]["box"], s["wall"][0]["box"]
    grow = [(n - 1) * (body["high"][k] - body["low"][k]) for k, n in enumerate(tiles)] + [0.0]
    longer = lambda high: "[" + ", ".join(repr(round(x + g, 9)) for x, g in zip(high, grow)) + "]"
    return [f"body.0.box.high={longer(body['high'])}", f"wall.0.box.high={longer(wall['high'])}"]


def points_of(plan, args, profile):
    """One dictionary a point: name, series, scene, ranks, threads, nodes, cores, set."""
    extra = plan.get("quick", {}).get("set", []) if args.quick else []
    out = []
    for k, case in enumerate(plan["case"]):
        sets = [*plan.get("set", []), *extra, *case.get("set", [])]
        if "tiles" in case:
            sets += widened(case["scene"], case["tiles"])
        series = case["series"]
        layouts = []
        if profile:
            node = profile["node"]
            per_node = node["ranks"]
            cores = node.get("cores") or len(os.sched_getaffinity(0))
            counts = [case["share"]] if plan["kind"] == "weak" else plan.get("machine", {}).get("nodes", [1])
            layouts = [(n, n * per_node, max(1, cores * node.get("threads_per_core", 1) // per_node), n * cores) for n in counts]
        elif plan["kind"] == "weak":
            threads = plan.get("here", {}).get("threads", 1)
            layouts = [(1, case["share"], threads, case["share"] * threads)]
        else:
            layouts = [(1, r, t, r * t) for r, t in plan.get("here", {}).get("layouts", [[1, 1]])]
        for nodes, ranks, threads, cores in layouts:
            name = f"{series}-{nodes}n{ranks}x{threads}" if profile else f"{series}-{ranks}x{threads}"
            out.append(
                dict(name=name, series=series, scene=case["scene"], nodes=nodes, ranks=ranks, threads=threads, cores=cores, set=sets)
            )
    names = [p["name"] for p in out]
    if len(set(names)) < len(names):
        raise Wrong(f"{args.plan}: two points are called {next(n for n in names if names.count(n) > 1)}; give their cases different series")
    return out


# ---------------------------------------------------------------------------------------------- running
def loaded(directory):
    """summary and timers of a finished run, or None."""
    try:
        with open(os.path.join(directory, "summary.json")) as f:
            summary = json.load(f)
        with open(os.path.join(directory, "timers.json")) as f:
            timers = json.load(f)
    except (OSError, ValueError):
        return None
    return (summary, timers) if summary.get("status") == "finished" else None


def same_point(directory, point):
    """Whether what lies there was made by this point as it is now; a point that has changed is run anew."""
    try:
        with open(directory + ".point.json") as f:
            return json.load(f) == point
    except (OSError, ValueError):
        return False


def prepared(directory, point):
    """Takes away what an earlier form of the point left and notes the present one."""
    if not same_point(directory, point):
        shutil.rmtree(directory, ignore_errors=True)
    os.makedirs(os.path.dirname(directory), exist_ok=True)
    with open(directory + ".point.json", "w") as f:
        json.dump(point, f)


def set_arguments(point):
    return [word for value in point["set"] for word in ("--set", value)]


def surroundings():
    """The environment with the settings of jobs/environment.sh: Open MPI's, and KUZURE_CORES."""
    done = subprocess.run(
        ["bash", "-c", 'source "$1" && env -0', "_", os.path.join(ROOT, "jobs/environment.sh")], capture_output=True, text=True, check=True
    )
    environment = dict(line.split("=", 1) for line in done.stdout.split("\0") if line)
    environment.pop("OMP_NUM_THREADS", None)
    return environment


def run_here(points, repeats, out, kuzure):
    """Every repeat visits every point before the next repeat begins, so that a slow minute of the machine meets all alike."""
    environment = surroundings()
    cores = int(environment["KUZURE_CORES"])
    can = [p for p in points if p["cores"] <= cores]
    for p in points:
        if p not in can:
            print(
                f"{p['name']}: needs {p['cores']} cores, this host has {cores}: not run here (--machine NAME makes a job of it)", flush=True
            )
    for k in range(repeats):
        for p in can:
            directory = os.path.join(out, p["name"], f"run_{k}")
            if same_point(directory, p) and loaded(directory):
                continue
            prepared(directory, p)
            shutil.rmtree(directory, ignore_errors=True)
            command = ["mpirun", "-n", str(p["ranks"])] if p["ranks"] > 1 else []
            command += [kuzure, "run", p["scene"], *set_arguments(p), "-o", directory, "--threads", str(p["threads"]), "--quiet"]
            done = subprocess.run(command, env=environment, capture_output=True, text=True)
            if done.returncode != 0:
                raise RuntimeError(f"{p['name']}: {' '.join(command)}\nended with {done.returncode}: {done.stderr.strip()[-800:]}")
            print(f"{p['name']} {k + 1}/{repeats}: {1e3 * loaded(directory)[0]['seconds_per_step']:.2f} ms a step", flush=True)


def make_jobs(points, out, kuzure, args, profile):
    for p in points:
        directory = os.path.join(out, p["name"], "run_0")
        if same_point(directory, p) and loaded(directory):
            continue
        prepared(directory, p)
        script = directory + ".sh"
        if args.submit and os.path.exists(directory + ".submitted"):
            print(f"{p['name']}: submitted already; remove {directory}.submitted to submit it again")
            continue
        command = [kuzure, "job", p["scene"], *set_arguments(p), "--machine", args.machine, "--nodes", str(p["nodes"]), "-o", directory]
        for option in ("account", "mode", "minutes"):
            if getattr(args, option):
                command += [f"--{option}", str(getattr(args, option))]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode != 0:
            raise Wrong(f"{p['name']}: {done.stderr.strip()}")
        with open(script, "w") as f:
            f.write(done.stdout)
        if not args.submit:
            print(f"{profile['submit']} {script}")
            continue
        done = subprocess.run([profile["submit"], script], cwd=os.path.dirname(directory), capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"{p['name']}: {profile['submit']} {script}\nended with {done.returncode}: {done.stderr.strip()[-800:]}")
        with open(directory + ".submitted", "w") as f:
            f.write(done.stdout)
        print(f"{p['name']}: {done.stdout.strip()}")


# ---------------------------------------------------------------------------------------------- the numbers
def costs(summary, timers, cores, steps_per_output):
    """Core-ns for each soil particle and step, by group. Starting (setup) is left out; the groups' sum is the whole. With
    steps_per_output a snapshot, picture and checkpoint each are charged once in so many steps, as in a long run."""
    phases = timers["phases"]
    seconds = lambda name, what="mean": phases.get(name, {}).get("seconds", {}).get(what, 0.0)
    unit = 1e9 * cores / (summary["soil_particles"] * timers["steps"])
    group = {g: sum(seconds(p) for p in members) for g, members in GROUPS.items()}
    if steps_per_output:
        for p in ("snapshot", "picture", "checkpoint"):
            if p in phases:
                group["I/O"] += seconds(p) * (timers["steps"] / steps_per_output / phases[p]["calls"] - 1)
    known = {p for members in GROUPS.values() for p in members} | {"setup"}
    unknown = [p for p in phases if p not in known]
    if unknown:
        raise RuntimeError(f"timers.json has phases that no group of jobs/scaling.py counts: {unknown}")
    # The mean rank waits for the slowest: at the reduction that ends every step, and before that for its halo.
    waiting = timers["pair_loop"]["seconds"]["max"] - timers["pair_loop"]["seconds"]["mean"]
    for g, wait in (("reductions", "reduce"), ("halo", "wait for halo")):
        taken = min(max(0.0, waiting), seconds(wait))
        group[g] -= taken
        group["imbalance"] += taken
        waiting -= taken
    return {g: unit * s for g, s in group.items()}


def collected(points, repeats, out, steps_per_output):
    """A row for every point with results: the repeat of the median time stands for it."""
    rows = []
    for p in points:
        runs = []
        for k in range(repeats):
            directory = os.path.join(out, p["name"], f"run_{k}")
            found = loaded(directory) if same_point(directory, p) else None
            if found:
                runs.append((found[0]["seconds_per_step"], directory, *found))
        if not runs:
            continue
        runs.sort(key=lambda r: r[0])
        _, directory, summary, timers = runs[len(runs) // 2]
        cost = costs(summary, timers, p["cores"], steps_per_output)
        rows.append(
            dict(
                point=p["name"],
                series=p["series"],
                nodes=p["nodes"],
                ranks=p["ranks"],
                threads=p["threads"],
                cores=p["cores"],
                soil=summary["soil_particles"],
                steps=timers["steps"],
                runs=len(runs),
                ms_step=1e3 * runs[len(runs) // 2][0],
                ms_low=1e3 * runs[0][0],
                ms_high=1e3 * runs[-1][0],
                balance=timers["pair_loop"]["seconds"]["max"] / max(1e-12, timers["pair_loop"]["seconds"]["mean"]),
                hash=summary["state_hash"],
                core_ns=sum(cost.values()),
                **{f"ns {g}": c for g, c in cost.items()},
            )
        )
    # Against the fewest cores of the series (threads before ranks: one rank has nobody to talk to).
    for series in {r["series"] for r in rows}:
        mine = [r for r in rows if r["series"] == series]
        base = min(mine, key=lambda r: (r["cores"], r["ranks"]))
        for r in mine:
            r["efficiency"] = base["core_ns"] / r["core_ns"]
            r["speedup"] = r["efficiency"] * r["cores"] / base["cores"]
            for g in GROUPS:
                r[f"lost {g}"] = (r[f"ns {g}"] - base[f"ns {g}"]) / r["core_ns"]
            r["base"] = r is base
    return rows


# ---------------------------------------------------------------------------------------------- report
def plot(out, name, commands):
    head = """set border 3 lc rgb '#404040'; set tics nomirror textcolor rgb '#404040'; set grid lc rgb '#e4e4e4'
set key outside right top Left reverse samplen 2
"""
    for ending, terminal in (
        ("svg", "svg size 900,480 font 'DejaVu Sans,13' lw 1.3 background rgb 'white'"),
        ("png", "pngcairo size 900,480 font 'DejaVu Sans,11' lw 1.3"),
    ):
        text = f"set terminal {terminal}\nset output '{name}.{ending}'\n{head}{commands}"
        done = subprocess.run(["gnuplot"], input=text, cwd=out, capture_output=True, text=True)
        if done.returncode != 0:
            raise RuntimeError(f"gnuplot, {name}: {done.stderr.strip()[-800:]}")


def draw(rows, out):
    series = list(dict.fromkeys(r["series"] for r in rows))
    block = (
        lambda name, chosen: f"${name} << EOD\n"
        + "".join(f"{r['cores']} {r['efficiency']} \"{r['ranks']}x{r['threads']}\"\n" for r in chosen)
        + "EOD\n"
    )
    data, lines = "", []
    for k, s in enumerate(series):
        mine = sorted((r for r in rows if r["series"] == s), key=lambda r: (r["cores"], r["efficiency"]))
        best = list({r["cores"]: r for r in mine}.values())  # the line joins the best layouts
        data += block(f"s{k}", mine) + block(f"b{k}", best)
        colour = f"lc rgb '{COLOURS[k % len(COLOURS)]}'"
        lines.append(
            f"$b{k} using 1:2 with lines {colour} notitle, $s{k} using 1:2 with points pt 7 {colour} title {in_gnuplot(s)} noenhanced, "
            f"$s{k} using 1:2:3 with labels offset 0,1 font ',9' notitle"
        )
    lines = ", ".join(lines)
    top = max(1.0, max(r["efficiency"] for r in rows)) + 0.1
    plot(
        out,
        "efficiency",
        f"{data}set logscale x 2\nset xrange [{0.7 * min(r['cores'] for r in rows)}:{1.4 * max(r['cores'] for r in rows)}]\n"
        f"set yrange [0:{top}]\nset xlabel 'cores (labels: ranks x threads)'\nset ylabel 'efficiency of a core'\nplot 1 lc rgb '#b0b0b0' notitle, {lines}\n",
    )
    # Each bar is the cost of a particle and step in core-ns, by what it goes to.
    table = "".join(f"\"{r['point']}\" " + " ".join(f"{max(0.0, r['ns ' + g]):.6g}" for g in GROUPS) + "\n" for r in rows)
    bars = ", ".join(f"$d using {k + 2}:xtic(1) lc rgb '{COLOURS[k]}' title '{g}'" for k, g in enumerate(GROUPS))
    plot(
        out,
        "losses",
        f"$d << EOD\n{table}EOD\nset style data histograms\nset style histogram rowstacked\nset style fill solid 0.9 border lc rgb 'white'\n"
        f"set boxwidth 0.7\nset yrange [0:*]\nset xtics rotate by -25 font ',10' noenhanced\nset ylabel 'core-ns for a soil particle and step'\nplot {bars}\n",
    )


def percent(x):
    return f"{100 * x:.1f} %"


def report(plan, rows, points, out, where):
    text = [
        f"# {plan['title']}",
        "",
        f"{where}; {len(rows)} of {len(points)} points have results. Median of the repeats.",
        "",
        "| point | nodes | ranks x threads | soil | ms a step (lowest..highest) | core-ns a particle and step | speed-up | efficiency | slowest rank / mean |",
        "|---|---|---|---|---|---|---|---|---|",
    ]
    for r in rows:
        text.append(
            f"| {r['point']} | {r['nodes']} | {r['ranks']} x {r['threads']} | {r['soil']:,} | {r['ms_step']:.3g} ({r['ms_low']:.3g}..{r['ms_high']:.3g}) | "
            f"{r['core_ns']:.4g} | {r['speedup']:.3f} | {r['efficiency']:.3f} | {r['balance']:.3f} |"
        )
    text += [
        "",
        "![efficiency](efficiency.svg)",
        "",
        "## Where the efficiency goes",
        "Share of a core's time that the reference of the series (fewest cores) does not spend; negative is a gain. The rows add up to 1 - efficiency.",
        "",
        "| point | lost | " + " | ".join(GROUPS) + " | largest |",
        "|---|---|" + "---|" * (len(GROUPS) + 1),
    ]
    for r in rows:
        if r["base"]:
            text.append(f"| {r['point']} | reference |" + " |" * (len(GROUPS) + 1))
            continue
        worst = max(GROUPS, key=lambda g: r[f"lost {g}"])
        named = f"**{worst}**" if r[f"lost {worst}"] > 0 else "none"
        text.append(
            f"| {r['point']} | {percent(1 - r['efficiency'])} | " + " | ".join(percent(r[f"lost {g}"]) for g in GROUPS) + f" | {named} |"
        )
    text += [
        "",
        "![losses](losses.svg)",
        "",
        "kernel: pair loops and update on the mean rank. imbalance: what the slowest rank computes longer than the mean, taken out of the waits. halo: packing,",
        "ghost plans and what remains of the wait for halo. I/O: "
        + (
            f"snapshot, picture and checkpoint once in {plan['steps_per_output']} steps, as in a long run, and history."
            if plan.get("steps_per_output")
            else "snapshots, pictures, checkpoint and history of these short runs, which begin and end with them."
        ),
        "",
    ]
    hashes = {}
    for r in rows:
        hashes.setdefault((r["series"], r["soil"], r["steps"]), set()).add(r["hash"])
    equal = all(len(h) == 1 for h in hashes.values())
    text.append(
        "The same soil gave the same state_hash on every layout."
        if equal
        else f"**State hashes differ between layouts of the same soil: {hashes}**"
    )
    with open(os.path.join(out, "report.md"), "w") as f:
        f.write("\n".join(text) + "\n")
    with open(os.path.join(out, "points.csv"), "w", newline="") as f:
        writer = csv.DictWriter(f, list(rows[0]))
        writer.writeheader()
        writer.writerows(rows)
    return equal


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("plan", metavar="SCALING.toml")
    parser.add_argument("-o", dest="out", metavar="DIR")
    parser.add_argument("--quick", action="store_true", help="the smaller settings of its table [quick]")
    parser.add_argument("--kuzure", default=os.path.join(ROOT, "build/release/kuzure"), metavar="PROGRAM")
    parser.add_argument("--machine", metavar="NAME", help="a profile of jobs/machines, or the path of one")
    parser.add_argument("--submit", action="store_true", help="hand the scripts to the batch system")
    parser.add_argument("--account", help="project that pays")
    parser.add_argument("--mode", help="how nodes are set up")
    parser.add_argument("--minutes", type=float, help="clock limit of every job")
    args = parser.parse_args()
    try:
        if args.submit and not args.machine:
            raise Wrong("--submit: expected --machine NAME beside it")
        if not os.access(args.kuzure, os.X_OK):
            raise Wrong(f"{args.kuzure}: no program here; jobs/build.sh release kuzure, or --kuzure PROGRAM")
        plan = read_plan(args.plan)
        profile = None
        if args.machine:
            path = (
                args.machine
                if "/" in args.machine or args.machine.endswith(".toml")
                else os.path.join(ROOT, "jobs/machines", args.machine + ".toml")
            )
            try:
                with open(path, "rb") as f:
                    profile = tomllib.load(f)
                profile["submit"] = submit_command(path, profile.get("batch"))
            except (OSError, tomllib.TOMLDecodeError) as e:
                raise Wrong(f"--machine {args.machine}: {e}")
        name = os.path.splitext(os.path.basename(args.plan))[0] + ("-quick" if args.quick else "")
        if profile:
            name += "-" + os.path.splitext(os.path.basename(args.machine))[0]
        out = os.path.abspath(args.out or os.path.join("results/scaling", name))
        points = points_of(plan, args, profile)
        repeats = 1 if profile else plan.get("quick", {}).get("repeats", 1) if args.quick else plan.get("repeats", 1)
        os.makedirs(out, exist_ok=True)
        if profile:
            make_jobs(points, out, args.kuzure, args, profile)
        else:
            run_here(points, repeats, out, args.kuzure)
        rows = collected(points, repeats, out, plan.get("steps_per_output"))
        if not rows:
            print(f"no point of {args.plan} has results yet")
            return 0
        where = (
            profile["title"]
            if profile
            else f"Host {os.uname().nodename}, {len(os.sched_getaffinity(0))} cores, {repeats} repeat{'s' if repeats > 1 else ''} in turn"
        )
        draw(rows, out)
        equal = report(plan, rows, points, out, where)
        print(f"{len(rows)} of {len(points)} points: {os.path.join(out, 'report.md')}")
        return 0 if equal else 3
    except Wrong as e:
        print(f"scaling.py: {e}", file=sys.stderr)
        return 2
    except RuntimeError as e:
        print(f"scaling.py: {e}", file=sys.stderr)
        return 4


if __name__ == "__main__":
    sys.exit(main())
