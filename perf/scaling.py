#!/usr/bin/python3
"""The figures of docs/performance.md, one command each:
    perf/scaling.py weak      the paper's three cases on Oakforest-PACS: predicted efficiency and where it goes, for 1, 4, 32 ranks a node
    perf/scaling.py series    the same height, tiled sideways, up to 8,208 nodes: predicted efficiency, time and memory of the cut
    perf/scaling.py balance   max/mean of pair work from real cuts, at the start and, with --from DIR, later in hirata_52
    perf/scaling.py drift     later cuts between neighbours: hirata_52 moved from its start to --from DIR in --steps N straight steps, on 64 imagined ranks
    perf/scaling.py model     the model against runs here on 1 and 2 ranks (needs a quiet machine)
    perf/scaling.py work      what a wall pair and a particle cost in units of a soil pair (needs a quiet machine)
    perf/scaling.py serial    time of each phase with 1 and 2 threads, and the serial share that they tell (needs a quiet machine)
    perf/scaling.py plot      docs/figures/scaling.svg and cut.svg from build/scaling/*.json
--default predicts steps of the staggered scheme, of which hirata_52 takes 790 a second, for the paper's, of which it takes 10,000.
Answers are Markdown; the numbers stay in build/scaling. The program is build/release/kuzure, or --program PATH."""
# Beyond 400 lines: one function a figure.
import argparse
import json
import os
import subprocess
import sys
import tempfile

here = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
kept = os.path.join(here, "build", "scaling")
SCENES = os.path.join(here, "jobs", "scenes")
PER_NODE = 52**3
args = None  # of the command line


def scale(scene, ranks, *extra):
    scheme = ["--set", 'accuracy.scheme="staggered"'] if args.default else []
    done = subprocess.run(
        [args.program, "scale", scene, "--ranks", ",".join(map(str, ranks)), "--json", *scheme, *extra], capture_output=True, text=True
    )
    if done.returncode != 0:
        sys.exit(done.stderr)
    return json.loads(done.stdout)


def keep(name, rows):
    os.makedirs(kept, exist_ok=True)
    with open(os.path.join(kept, name + ".json"), "w") as f:
        json.dump(rows, f, indent=1)


def table(head, rows):
    print("| " + " | ".join(head) + " |\n|" + "---|" * len(head))
    for r in rows:
        print("| " + " | ".join(r) + " |")
    print(flush=True)


LOSSES = ("imbalance", "halo", "reduction", "rebuild", "recut")


def against(base, base_soil, case, soil):
    """Efficiency per soil particle and core, and what each cause takes of it, of the whole step."""
    t, n = case["predicted_seconds_per_step"], case["nodes"] / base["nodes"]
    efficiency = base["predicted_seconds_per_step"] / t * (soil / base_soil) / n
    kernel = case["predicted_step"]["pairs"] + case["predicted_step"]["particles"]
    ideal = (base["predicted_step"]["pairs"] + base["predicted_step"]["particles"]) * (soil / base_soil) / n
    return efficiency, {"more pairs": (kernel - ideal) / t, **{k: case["predicted_step"][k] / t for k in LOSSES}}


def weak():
    rows = []
    for per_node in (1, 4, 32):
        out, base = [], None
        for edge, nodes in ((52, 1), (104, 8), (208, 64)):
            case = scale(
                os.path.join(SCENES, f"hirata_{edge}.toml"),
                [nodes * per_node],
                "--machine",
                args.machine,
                "--ranks-per-node",
                str(per_node),
            )[0]
            base = base or (case, edge**3)
            efficiency, lost = against(*base, case, edge**3)
            rows.append({"per_node": per_node, "nodes": nodes, "efficiency": efficiency, "lost": lost, **case})
            worse = case["predicted_seconds_per_step_if"]
            t = case["predicted_seconds_per_step"]
            out.append(
                [
                    str(nodes),
                    str(case["ranks"]),
                    f"{case['pair_balance']:.3f}",
                    f"{case['ghost_share']:.3f}",
                    f"{1e3 * t:.2f}",
                    f"**{efficiency:.3f}**",
                    *[f"{100 * lost[k]:.1f}" for k in lost],
                    f"{efficiency * t / worse['latency_doubled']:.3f}",
                    f"{efficiency * t / worse['bandwidth_halved']:.3f}",
                ]
            )
        print(f"{per_node} rank{'s' * (per_node > 1)} a node, {args.machine}")
        table(
            [
                "nodes",
                "ranks",
                "pairs max/mean",
                "ghosts per soil",
                "step, ms",
                "weak efficiency",
                "more pairs, %",
                "imbalance, %",
                "halo, %",
                "reduction, %",
                "rebuild, %",
                "re-cut, %",
                "latency x 2",
                "bandwidth / 2",
            ],
            out,
        )
    keep("weak", rows)


def tiled(nx, ny, folder):
    """hirata_52 side by side: the same soil, height and margins."""
    with open(os.path.join(SCENES, "hirata_52.toml")) as f:
        text = f.read()
    x, y = 3.28 + 2.08 * nx, 3.28 + 2.08 * ny
    for old, new in (
        ("high = [5.36, 5.36, 2.08]", f"high = [{x:.2f}, {y:.2f}, 2.08]"),
        ("high = [8.64, 8.64, 0.0]", f"high = [{x + 3.28:.2f}, {y + 3.28:.2f}, 0.0]"),
    ):
        assert old in text
        text = text.replace(old, new)
    name = os.path.join(folder, f"tiled_{nx}x{ny}.toml")
    with open(name, "w") as f:
        f.write(text)
    return name


def series():
    rows, out, base = [], [], None
    with tempfile.TemporaryDirectory() as folder:
        for nx, ny in ((1, 1), (2, 1), (2, 2), (4, 4), (8, 8), (16, 16), (32, 32), (64, 32), (76, 54), (108, 76)):
            if nx * ny > args.nodes:
                break
            nodes = nx * ny
            case = scale(tiled(nx, ny, folder), [4 * nodes], "--machine", args.machine, "--ranks-per-node", "4")[0]
            base = base or case
            efficiency, lost = against(base, PER_NODE, case, nodes * PER_NODE)
            rows.append({"nodes": nodes, "efficiency": efficiency, "lost": lost, **case})
            keep("series", rows)
            t, worse = case["predicted_seconds_per_step"], case["predicted_seconds_per_step_if"]
            out.append(
                [
                    f"{nodes:,}",
                    f"{case['ranks']:,}",
                    f"{nodes * PER_NODE / 1e6:,.1f}",
                    f"{case['pair_balance']:.3f}",
                    f"{case['ghost_share']:.3f}",
                    f"{1e3 * t:.2f}",
                    f"**{efficiency:.3f}**",
                    *[f"{100 * lost[k]:.1f}" for k in lost],
                    f"{efficiency * t / worse['latency_doubled']:.3f}",
                    f"{efficiency * t / worse['bandwidth_halved']:.3f}",
                    f"{case['blocks']:,}",
                    f"{case['cut_seconds']:.2f}",
                    f"{case['peak_memory_bytes_here'] / 1e6:,.0f}",
                ]
            )
            print(f"{nodes} nodes: efficiency {efficiency:.3f}, cut {case['cut_seconds']:.2f} s", file=sys.stderr, flush=True)
    table(
        [
            "nodes",
            "ranks",
            "soil, millions",
            "pairs max/mean",
            "ghosts per soil",
            "step, ms",
            "weak efficiency",
            "more pairs, %",
            "imbalance, %",
            "halo, %",
            "reduction, %",
            "rebuild, %",
            "re-cut, %",
            "latency x 2",
            "bandwidth / 2",
            "blocks",
            "cut here, s",
            "memory here, MB",
        ],
        out,
    )


def balance():
    out, rows = [], []
    cases = [("hirata_52", (2, 4, 7, 16, 32, 64, 128)), ("hirata_104", (256, 512)), ("hirata_208", (256, 1024, 2048, 4096))]
    if args.state:
        cases = [("hirata_52", (2, 4, 7, 16, 32, 64, 128))]
    for name, ranks in cases:
        scene = os.path.join(args.state, "scene.toml") if args.state else os.path.join(SCENES, name + ".toml")
        for case in scale(scene, ranks, *(["--from", args.state] if args.state else [])):
            rows.append({"scene": name, **case})
            out.append(
                [
                    name,
                    str(case["ranks"]),
                    f"{case['largest_rank']['soil']:,}",
                    f"{case['pair_balance']:.3f}",
                    f"{case['ghost_share']:.3f}",
                    f"{case['messages_per_step'] / case['ranks']:.1f}",
                    str(case["scattered_ranks"]),
                    f"{case['cut_seconds']:.2f}",
                ]
            )
    keep("balance", rows)
    table(["scene", "ranks", "soil, most", "pairs max/mean", "ghosts per soil", "messages a rank", "scattered", "cut here, s"], out)


def drift():
    scene = os.path.join(args.state, "scene.toml")
    done = subprocess.run(
        [args.program, "scale", scene, "--ranks", str(args.ranks), "--from", args.state, "--recuts", str(args.steps)],
        check=True,
        capture_output=True,
        text=True,
    )
    cuts = json.loads(done.stdout)[0]["cuts"]
    keep("drift", cuts)
    every = max(1, len(cuts) // 10)
    table(
        [
            "cut",
            "max/mean before",
            "after",
            "blocks moved, %",
            "sweeps",
            "rounds",
            "scattered",
            "peers",
            "halo of it, MB",
            "busy, ms",
            "blocks known",
        ],
        [
            [
                str(k),
                f"{c['before']:.3f}",
                f"{c['after']:.3f}",
                f"{100 * c['moved_blocks'] / c['blocks']:.1f}",
                str(c["sweeps"]),
                str(c["rounds"]),
                str(c["scattered"]),
                f"{c['peers_mean']:.1f}",
                f"{1e-6 * c['cut_bytes']:.1f}",
                f"{1e3 * c['busy_seconds']:.1f}",
                str(c["known_most"]),
            ]
            for k, c in enumerate(cuts, 1)
            if k % every == 0
        ],
    )
    last = cuts[-1]["whole"]
    print(
        f"METIS at the end: {last['balance']:.3f}, {1e-6 * last['cut_bytes']:.1f} MB, {last['scattered']} scattered, {last['seconds']:.2f} s"
    )


def timed(ranks, threads, steps):
    """timers.json of a short run of hirata_52."""
    with tempfile.TemporaryDirectory() as folder:
        command = [
            args.program,
            "run",
            os.path.join(SCENES, "hirata_52.toml"),
            "-o",
            os.path.join(folder, "out"),
            "--quiet",
            "--threads",
            str(threads),
            "--set",
            f"time.end={steps * 1e-4:.6f}",
        ]
        if ranks > 1:
            command = ["mpirun", "-n", str(ranks)] + command
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
        with open(os.path.join(folder, "out", "timers.json")) as f:
            return json.load(f)


PER_STEP = ("begin halo", "interior pairs", "wait for halo", "rim pairs", "reduce", "other", "migrate", "sort", "ghosts", "lists", "guard")


def seconds(timers, phases=PER_STEP):
    return sum(timers["phases"][p]["seconds"]["mean"] for p in phases if p in timers["phases"]) / timers["steps"]


def median(values):
    return sorted(values)[len(values) // 2]


def model():
    steps, repeats, out, rows = args.steps, args.repeats, [], []
    ways = ((1, 1), (1, 2), (2, 1))
    found = {w: [] for w in ways}
    for _ in range(repeats):  # in turn: the machine's speed wanders
        for w in ways:
            found[w].append(seconds(timed(*w, steps)))
    for ranks, threads in ways:
        case = scale(os.path.join(SCENES, "hirata_52.toml"), [ranks], "--machine", "here", "--threads", str(threads))[0]
        did, said = median(found[ranks, threads]), case["predicted_seconds_per_step"]
        rows.append({"ranks": ranks, "threads": threads, "measured": found[ranks, threads], "predicted": said})
        out.append(
            [
                str(ranks),
                str(threads),
                f"{1e3 * did:.1f}",
                f"{1e3 * min(found[ranks, threads]):.1f} .. {1e3 * max(found[ranks, threads]):.1f}",
                f"{1e3 * said:.1f}",
                f"{100 * (said / did - 1):+.0f} %",
            ]
        )
    keep("model", rows)
    table(["ranks", "threads", "measured, ms a step", "range", "predicted", "error"], out)


def serial():
    """Amdahl: t(2)/t(1) = s + (1 - s)/2. Where nothing runs in parallel both times are equal and s is 1."""
    one, two = [], []
    for _ in range(args.repeats):
        one.append(timed(1, 1, args.steps)), two.append(timed(1, 2, args.steps))
    step, out = median([seconds(t) for t in one]), []
    for p in PER_STEP:
        if p not in one[0]["phases"]:
            continue
        a, b = (median([seconds(t, (p,)) for t in runs]) for runs in (one, two))
        share = max(0.0, min(1.0, 2 * b / a - 1))
        out.append([p, f"{1e3 * a:.4f}", f"{1e3 * b:.4f}", f"{share:.2f}", f"{100 * 64 * share * a / step:.2f}"])
    table(["phase", "1 thread, ms a step", "2 threads", "serial share", "serial time, % of a 64th of the step"], out)


BLOCK = """title = "soil for measuring"
dimensions = 3
[space]
spacing = 0.04
h = 1.2
[time]
end = 0.005
step = 1.0e-4
[soil.sand]
density = 1850.0
young = 1.8e6
poisson = 0.3
cohesion = 0.0
friction_angle = 25.0
[[body]]
soil = "sand"
box = {{ low = [0.0, 0.0, 0.0], high = [{side:.2f}, {side:.2f}, {height:.2f}] }}
[effects]
gravity = [0.0, 0.0, -9.81]
viscosity = {{ alpha = 0.1, beta = 0.0 }}
[accuracy]
kernel = "cubic spline"
"""
FLOOR = """[[wall]]
box = {{ low = [-0.4, -0.4, -0.16], high = [{edge:.2f}, {edge:.2f}, 0.0] }}
"""


def work():
    """What a wall pair and a particle cost in units of a soil pair: three shapes of soil, three unknowns."""
    shapes = {"cube": (1.6, 1.6, False), "sheet": (4.8, 0.08, False), "sheet on a floor": (4.8, 0.08, True)}
    times, counts = {k: [] for k in shapes}, {}
    with tempfile.TemporaryDirectory() as folder:
        for name, (side, height, floor) in shapes.items():
            with open(os.path.join(folder, name + ".toml"), "w") as f:
                f.write(BLOCK.format(side=side, height=height) + (FLOOR.format(edge=side + 0.4) if floor else ""))
            rank = scale(os.path.join(folder, name + ".toml"), [1], "--per-rank")[0]["per_rank"][0]
            counts[name] = (rank["soil_pairs"], rank["wall_pairs"], rank["soil"])
        for _ in range(args.repeats):  # in turn
            for name in shapes:
                out = os.path.join(folder, "out")
                subprocess.run(
                    [args.program, "run", os.path.join(folder, name + ".toml"), "-o", out, "--quiet", "--force", "--threads", "1"],
                    check=True,
                    stdout=subprocess.DEVNULL,
                )
                with open(os.path.join(out, "timers.json")) as f:
                    times[name].append(seconds(json.load(f)))
    t = {k: median(v) for k, v in times.items()}
    (p1, _, n1), (p2, _, n2), (_, w3, _) = (counts[k] for k in shapes)
    pair = (t["cube"] * n2 - t["sheet"] * n1) / (p1 * n2 - p2 * n1)
    particle = (t["cube"] - pair * p1) / n1
    wall = (t["sheet on a floor"] - t["sheet"]) / w3
    table(
        ["shape", "soil pairs", "wall pairs", "particles", "ms a step"],
        [[k, *(f"{c:,}" for c in counts[k]), f"{1e3 * t[k]:.2f}"] for k in shapes],
    )
    print(f"a soil pair {1e9 * pair:.2f} ns; a wall pair {wall / pair:.2f} and a particle {particle / pair:.1f} of it")


def plot():
    script = 'set term svg size 900,380 font "sans,12" background "white"\nset grid\nset key left bottom\n'
    with open(os.path.join(kept, "series.json")) as f:
        rows = json.load(f)
    data = (
        "$s << E\n"
        + "\n".join(
            " ".join(
                map(
                    str,
                    (
                        r["nodes"],
                        r["efficiency"],
                        r["efficiency"] * r["predicted_seconds_per_step"] / r["predicted_seconds_per_step_if"]["latency_doubled"],
                        r["efficiency"] * r["predicted_seconds_per_step"] / r["predicted_seconds_per_step_if"]["bandwidth_halved"],
                        r["ranks"],
                        r["cut_seconds"],
                        r["peak_memory_bytes_here"] / 1e9,
                    ),
                )
            )
            for r in rows
        )
        + "\nE\n"
    )
    figures = os.path.join(here, "docs", "figures")
    script += (
        data
        + f"""set logscale x
set output "{figures}/scaling.svg"
set title "self-similar series, 140,608 soil particles and 4 ranks a node, {args.machine} (predicted)"
set xlabel "nodes"; set ylabel "weak efficiency per soil particle"; set yrange [0:1.05]
plot $s u 1:2 w lp lw 2 pt 7 t "model", "" u 1:3 w lp dt 2 t "latency x 2", "" u 1:4 w lp dt 3 t "bandwidth / 2", 0.9 w l lc "grey" t "0.90", \\
     "< echo 64 0.22" u 1:2 w p pt 5 ps 1.3 lc "red" t "the paper, 64 nodes"
set output "{figures}/cut.svg"
set title "the serial cut: METIS on one core of this machine"; set xlabel "ranks"; set ylabel "s, GB"; set yrange [*:*]; set logscale y; set key left top
plot $s u 5:6 w lp lw 2 pt 7 t "seconds", "" u 5:7 w lp lw 2 pt 5 t "GB, of the whole program"
"""
    )
    subprocess.run(["gnuplot"], input=script, text=True, check=True)
    print(f"{figures}/scaling.svg {figures}/cut.svg")


def main():
    global args
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("figure", choices=("weak", "series", "balance", "drift", "model", "work", "serial", "plot"))
    parser.add_argument("--program", default=os.path.join(here, "build", "release", "kuzure"))
    parser.add_argument("--machine", default="oakforest-pacs")
    parser.add_argument("--nodes", type=int, default=8208, help="largest of the series")
    parser.add_argument("--from", dest="state", help="result directory of hirata_52")
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--ranks", type=int, default=64, help="of drift")
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--default", action="store_true", help="by the staggered scheme, else by the paper's")
    args = parser.parse_args()
    globals()[args.figure]()


if __name__ == "__main__":
    main()
