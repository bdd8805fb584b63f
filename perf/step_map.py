#!/usr/bin/python3
"""The map of stable steps of the staggered scheme: the largest Courant number dt c_p/h at which a run keeps its energy, by
bisection over a fixed, forced step, beside the limit that the program itself computes for the scene.

Plain cases (an elastic bar that hits a wall, a column under sudden weight, a collapse) run over kernels, smoothing lengths and
viscosities; every other case (walls, slopes, corners, layers, further terms, 3-D, fast impact) with the default kernel and two
viscosities. Stable: the run ends by itself and the sum of its energies leaves that of the start by at most 2 % of the largest
energy of the run, in every row of its history, and dissipated energies fall by no more than that. Accurate: by at most 0.2 %.
With corrected gradients, whose error is the same at any step, stable is 10 %.

Leaves step_map.csv in the directory of --results, where it also finds what an earlier call has done; step_map.md, the table of
docs/accuracy.md; and step_map.png in that of --figures."""

import argparse
import csv
import math
import os
import re
import resource
import subprocess
import sys
import tempfile

DX, YOUNG, NU, RHO = 0.04, 1.8e6, 0.3, 1850.0
KERNELS = [("cubic spline", 1.2), ("wendland c2", 1.3), ("wendland c2", 1.5), ("wendland c4", 1.8)]
DEFAULT = ("wendland c2", 1.3)
ALPHAS = [0.0, 0.1, 0.5, 1.0]
TERMS = "kinetic potential elastic plastic viscous wall damping stabilising moved_wall".split()
FIELDS = "case kernel h alpha limit stable accurate at_default at_refused".split()
STABLE, ACCURATE = 0.02, 0.002
CORRECTED = 0.1  # corrected gradients are not adjoint to the forces: energy is off by percents at any step
REFUSED, WARNED = 0.93, 0.78  # of the program's limit
RATIO, FEWEST, MOST = 1.05, -40, 10  # Courant numbers tried: the refused one times RATIO^n, FEWEST <= n <= MOST

ELASTIC = "cohesion = 1.0e9\ntension_cutoff = 1.0e9"
SAND = 'friction_angle = 25.0\ncone = "plane strain"'
SAND_3D = "friction_angle = 25.0"
CLAY = 'cohesion = 5000.0\nfriction_angle = 20.0\ncone = "plane strain"'
PERIODIC = 'low = [0.0, 0.0, -1.0]\nhigh = [0.4, 0.0, 4.0]\nperiodic = ["x"]'
PERIODIC_3D = 'low = [0.0, 0.0, -1.0]\nhigh = [0.4, 0.4, 4.0]\nperiodic = ["x", "y"]'
SMOOTH, COULOMB = '"smooth"', "{ friction_angle = 20.0 }"


def p_wave(young):
    return math.sqrt(young * (1 - NU) / ((1 + NU) * (1 - 2 * NU)) / RHO)


def box(low, high, more=""):
    return f"box = {{ low = {list(low)}, high = {list(high)} }}\n{more}"


def polygon(*points, more=""):
    return f"polygon = {{ points = {[list(p) for p in points]} }}\n{more}"


def on_floor(surface='"rough"', reach=1.0):
    return [box((-reach, -reach, -0.2), (reach + 0.4, reach + 0.4, 0.0), f"surface = {surface}")]


def fill(young=YOUNG, strength=SAND):
    return f"density = {RHO}\nyoung = {young}\npoisson = {NU}\n{strength}\n"


class Case:
    def __init__(self, end, bodies, walls, soils=None, strength=SAND, **more):
        self.end, self.bodies, self.walls, self.dx = end, bodies, walls, more.get("dx", DX)
        self.soils = soils or {"s": (YOUNG, strength)}
        self.gravity, self.space = more.get("gravity", True), more.get("space", "")
        self.dimensions, self.effects = more.get("dimensions", 2), more.get("effects", "")
        self.accuracy, self.beta = more.get("accuracy", ""), more.get("beta", 0.0)
        self.rule = more.get("rule", False)  # the step follows accuracy.cfl and not a fixed step
        self.most = more.get("most", STABLE)
        self.kernels, self.alphas = more.get("kernels", [DEFAULT]), more.get("alphas", [0.1, 1.0])

    def crossing(self, h):
        return h * self.dx / max(p_wave(young) for young, _ in self.soils.values())

    def text(self, kernel, h, alpha, courant):
        step = courant * self.crossing(h)
        soils = "\n".join(f"[soil.{name}]\n{fill(*soil)}" for name, soil in self.soils.items())
        bodies = "\n".join("[[body]]\n" + (b if "soil =" in b else f'soil = "s"\n{b}') for b in self.bodies)
        effects = [self.effects] if self.effects else []
        if self.gravity:
            effects.append("gravity = [0.0, 0.0, -9.81]")
        if alpha > 0:
            effects.append(f"viscosity = {{ alpha = {alpha}, beta = {self.beta} }}")
        return "\n".join(
            [
                f'title = "stable step"\ndimensions = {self.dimensions}',
                f"[space]\nspacing = {self.dx}\nh = {h}\n{self.space}",
                f"[time]\nend = {self.end}\n" + ("" if self.rule else f"step = {step!r}"),
                soils,
                bodies,
                "\n".join(f"[[wall]]\n{w}" for w in self.walls),
                "[effects]\n" + "\n".join(effects),
                f'[accuracy]\nkernel = "{kernel}"\n{self.accuracy}\n' + (f"cfl = {courant!r}" if self.rule else ""),
                f"[output]\nhistory = {self.end / 50}\n",
            ]
        )


BAR = dict(strength=ELASTIC, space=PERIODIC, gravity=False)
FALL = "velocity = [0.0, 0.0, -0.1]"  # bonded to the wall, a faster bar tears: tension clumps particles at any step
FAST = "velocity = [0.0, 0.0, -1.0]"
BLOCK = [box((0.0, 0.0, 0.0), (0.4, 0.0, 0.8))]  # of collapses
UPRIGHT = [box((0.0, 0.0, 0.0), (0.4, 0.0, 1.0))]  # of columns
THROWN = [box((0.0, 0.0, 0.0), (0.4, 0.0, 1.0), FALL)]
CUBE = [box((0.0, 0.0, 0.0), (0.4, 0.4, 0.4))]


def down(x):
    """Height of a slope of 30 degrees that meets its floor at x = 1.4."""
    return 0.8 - x * 0.8 / 1.4


def slope(surface):
    corners = [(-0.4, down(-0.4)), (1.4, 0.0), (3.0, 0.0), (3.0, -0.3), (-0.4, -0.3)]
    return [polygon(*corners, more=f"surface = {surface}")]


SLAB = [polygon((0.1, down(0.1)), (0.7, down(0.7)), (0.7, down(0.7) + 0.3), (0.1, down(0.1) + 0.3))]


def corner(surface):
    s = f"surface = {surface}"
    return [box((-0.2, 0.0, -0.2), (1.6, 0.0, 0.0), s), box((-0.2, 0.0, 0.0), (0.0, 0.0, 1.2), s)]


def layers(below, above, strength, more=""):
    soils = {"below": (below, strength), "above": (above, strength)}
    bodies = [
        'soil = "below"\n' + box((0.0, 0.0, 0.0), (0.4, 0.0, 0.48), more),
        'soil = "above"\n' + box((0.0, 0.0, 0.48), (0.4, 0.0, 0.96), more),
    ]
    return dict(soils=soils, bodies=bodies, walls=on_floor_periodic())


def on_floor_periodic(surface='"rough"', deep=0.0):
    return [box((0.0, 0.0, -0.2), (0.4, deep, 0.0), f"surface = {surface}")]


def impact():
    thrown = f"velocity = [0.0, 0.0, {-0.3 * p_wave(YOUNG)}]"
    return dict(
        end=0.06, bodies=[box((0.0, 0.0, 0.0), (0.4, 0.0, 0.12)), box((0.08, 0.0, 0.16), (0.32, 0.0, 0.4), thrown)], walls=on_floor()
    )


PLAIN = dict(kernels=KERNELS, alphas=ALPHAS)
SOLID = dict(dimensions=3, dx=0.05, strength=SAND_3D)
BAR_3D = dict(
    bodies=[box((0.0, 0.0, 0.0), (0.4, 0.4, 0.5), FALL)],
    walls=on_floor_periodic(deep=0.4),
    **{**SOLID, "strength": ELASTIC},
    space=PERIODIC_3D,
    gravity=False,
    kernels=KERNELS[:3],  # the support of the fourth is wider than the period
)
CASES = {
    "bar": Case(0.3, THROWN, on_floor_periodic(), **BAR, **PLAIN),
    "column": Case(0.4, UPRIGHT, on_floor_periodic(), space=PERIODIC, **PLAIN),
    "collapse": Case(0.5, BLOCK, on_floor(), **PLAIN),
    "bar, 1 m/s, until it rebounds": Case(0.05, [box((0.0, 0.0, 0.0), (0.4, 0.0, 1.0), FAST)], on_floor_periodic(), **BAR),
    "bar, smooth wall": Case(0.3, THROWN, on_floor_periodic(SMOOTH), **BAR),
    "bar, Coulomb wall": Case(0.05, THROWN, on_floor_periodic(COULOMB), **BAR),
    "collapse, smooth wall": Case(0.5, BLOCK, on_floor(SMOOTH, 1.4)),
    "collapse, Coulomb wall": Case(0.5, BLOCK, on_floor(COULOMB)),
    "slope, rough": Case(0.5, SLAB, slope('"rough"')),
    "slope, smooth": Case(0.5, SLAB, slope(SMOOTH)),
    "slope, Coulomb": Case(0.5, SLAB, slope(COULOMB)),
    "corner, rough": Case(0.5, BLOCK, corner('"rough"')),
    "corner, smooth": Case(0.5, BLOCK, corner(SMOOTH)),
    "corner, Coulomb": Case(0.5, BLOCK, corner(COULOMB)),
    "over an edge": Case(
        0.5, [box((0.0, 0.0, 0.0), (0.4, 0.0, 0.6))], [box((-0.6, 0.0, -0.6), (0.4, 0.0, 0.0)), box((0.4, 0.0, -0.6), (2.0, 0.0, -0.4))]
    ),
    "column, stiff below soft (10)": Case(0.3, **layers(10 * YOUNG, YOUNG, SAND), space=PERIODIC),
    "column, soft below stiff (10)": Case(0.3, **layers(YOUNG, 10 * YOUNG, SAND), space=PERIODIC),
    "bar, soft before stiff (10)": Case(0.2, **layers(YOUNG, 10 * YOUNG, ELASTIC, FALL), space=PERIODIC, gravity=False),
    "cohesive column, artificial stress": Case(0.5, BLOCK, on_floor(), strength=CLAY, effects="artificial_stress = { epsilon = 0.5 }"),
    "column, stress diffusion 0.1": Case(0.4, UPRIGHT, on_floor_periodic(), space=PERIODIC, effects="stress_diffusion = { zeta = 0.1 }"),
    "column, stress diffusion 0.3": Case(0.4, UPRIGHT, on_floor_periodic(), space=PERIODIC, effects="stress_diffusion = { zeta = 0.3 }"),
    "column, stress diffusion 1": Case(0.4, UPRIGHT, on_floor_periodic(), space=PERIODIC, effects="stress_diffusion = { zeta = 1.0 }"),
    "collapse, stress diffusion 0.1": Case(0.5, BLOCK, on_floor(), effects="stress_diffusion = { zeta = 0.1 }"),
    "bar, gradient correction": Case(0.3, THROWN, on_floor_periodic(), **BAR, accuracy='correction = "gradient"', most=CORRECTED),
    "column, gradient correction": Case(
        0.4, UPRIGHT, on_floor_periodic(), space=PERIODIC, accuracy='correction = "gradient"', most=CORRECTED
    ),
    "collapse, gradient correction": Case(0.5, BLOCK, on_floor(), accuracy='correction = "gradient"', most=CORRECTED),
    "bar, adjoint correction": Case(0.3, THROWN, on_floor_periodic(), **BAR, accuracy='correction = "adjoint"'),
    "column, adjoint correction": Case(0.4, UPRIGHT, on_floor_periodic(), space=PERIODIC, accuracy='correction = "adjoint"'),
    "collapse, adjoint correction": Case(0.5, BLOCK, on_floor(), accuracy='correction = "adjoint"'),
    "collapse, mixed precision": Case(0.5, BLOCK, on_floor(), accuracy='precision = "mixed"'),
    "bar, 3-D": Case(0.15, **BAR_3D),
    "bar, adjoint correction, 3-D": Case(0.15, **BAR_3D, accuracy='correction = "adjoint"'),
    "collapse, 3-D": Case(0.3, CUBE, on_floor(reach=0.4), **SOLID, kernels=KERNELS),
    "impact, Mach 0.3, fixed step": Case(**impact(), beta=2.0),
    "impact, Mach 0.3, accuracy.cfl": Case(**impact(), beta=2.0, rule=True),
}


class Map:
    def __init__(self, program):
        self.program = os.path.abspath(program)
        self.runs = 0

    def call(self, command, scene, *more):
        words = [self.program, command, scene, *more]
        return subprocess.run(words, capture_output=True, text=True, timeout=600, env={**os.environ, "OMP_NUM_THREADS": "1"})

    def limit(self, case, kernel, h, alpha):
        """The program's limit of dt c_p/h, from what it says when it refuses a step far beyond it."""
        with tempfile.TemporaryDirectory(prefix="kuzure-step-") as work:
            scene = os.path.join(work, "s.toml")
            with open(scene, "w") as f:
                f.write(case.text(kernel, h, alpha, 4.0))
            said = self.call("check", scene).stderr
        found = re.search(r"stable limit ([0-9.e+-]+)( s)?", said)
        if not found:
            sys.exit(f"no limit in the words of check: {said}")
        value = float(found.group(1).rstrip(",."))
        return (value if case.rule else value / case.crossing(h)) / REFUSED

    def residual(self, case, kernel, h, alpha, courant):
        """Largest |sum of energies - that of the start|, or fall of a dissipated one, over the largest energy of the run; infinite
        where it failed."""
        self.runs += 1
        with tempfile.TemporaryDirectory(prefix="kuzure-step-") as work:
            scene, out = os.path.join(work, "s.toml"), os.path.join(work, "o")
            with open(scene, "w") as f:
                f.write(case.text(kernel, h, alpha, courant))
            done = self.call("run", scene, "-o", out, "--force-step", "--quiet", "--threads", "1")
            if done.returncode not in (0, 3):
                sys.exit(f"exit {done.returncode}: {done.stderr}\n{case.text(kernel, h, alpha, courant)}")
            if done.returncode == 3:
                return math.inf
            with open(os.path.join(out, "history.csv")) as f:
                rows = [r for r in csv.DictReader(f) if not r["time"].startswith("#")]
        totals, largest, fallen, most = [], 0.0, 0.0, {"plastic": 0.0, "viscous": 0.0}
        for row in rows:
            terms = {k: float(row[k]) for k in TERMS}
            totals.append(sum(terms.values()))
            largest = max(largest, terms["kinetic"], terms["elastic"], abs(terms["potential"]))
            for k in most:  # what is dissipated does not come back, even where the ledger closes
                most[k] = max(most[k], terms[k])
                fallen = max(fallen, most[k] - terms[k])
        worst = max(fallen, *(abs(total - totals[0]) for total in totals)) / largest
        return worst if math.isfinite(worst) else math.inf

    def measure(self, case, kernel, h, alpha):
        limit = self.limit(case, kernel, h, alpha)
        known = {}

        def at(courant):
            if courant not in known:
                known[courant] = self.residual(case, kernel, h, alpha, courant)
            return known[courant]

        def largest(most, low=FEWEST - 1, high=MOST + 1):
            tried = 0  # the refused step first
            while high - low > 1:
                low, high = (tried, high) if at(REFUSED * limit * RATIO**tried) <= most else (low, tried)
                tried = (low + high) // 2
            worse = min((c for c, r in known.items() if r > most), default=math.inf)
            return max((c for c, r in known.items() if r <= most and c < worse), default=0.0)

        at_default, at_refused = at(1.0), at(REFUSED * limit)
        return limit, largest(case.most), largest(ACCURATE), at_default, at_refused


def figure(rows, directory, results):
    """Plain cases over viscosity, and every other case as a bar beside the program's limit."""
    plain = [r for r in rows if r["case"] in ("bar", "column", "collapse")]
    other = [r for r in rows if r not in plain]
    places = list(dict.fromkeys((r["case"], r["kernel"], r["h"]) for r in other))
    data = os.path.join(results, "step_map.dat")
    with open(data, "w") as f:
        for name in ("bar", "column", "collapse"):
            for kernel, h in KERNELS:
                for r in plain:
                    if (r["case"], r["kernel"], r["h"]) == (name, kernel, h):
                        f.write(f"{r['alpha']} {r['stable']} {r['accurate']} {REFUSED * r['limit']}\n")
                f.write("\n\n")
        for alpha in (0.1, 1.0):
            for i, key in enumerate(places):
                for r in other:
                    if (r["case"], r["kernel"], r["h"]) == key and r["alpha"] == alpha:
                        name = key[0] if key[1:] == DEFAULT else f"{key[0]}, {key[1]} {key[2]}"
                        f.write(f"{len(places) - i} {r['stable']} {r['accurate']} {REFUSED * r['limit']} \"{name}\"\n")
            f.write("\n\n")
    script = [
        f"set terminal pngcairo size 1300,1150 font 'sans,10'\nset output '{directory}/step_map.png'\nset multiplot",
        "set grid\nset xlabel 'artificial viscosity alpha'\nset ylabel 'dt c_p/h'\nset yrange [0:2.4]\nset xrange [-0.03:1.03]",
    ]
    for i, name in enumerate(("bar", "column", "collapse")):
        lines = []
        for j, (kernel, h) in enumerate(KERNELS):
            index, colour = i * len(KERNELS) + j, f"lc {j + 1}"
            lines.append(f"'{data}' index {index} using 1:2 with linespoints pt 7 ps 0.8 lw 2 {colour} title '{kernel}, h {h}'")
            lines.append(f"'' index {index} using 1:3 with linespoints pt 6 ps 0.8 lw 1 {colour} notitle")
            lines.append(f"'' index {index} using 1:4 with lines dt 3 lw 1 {colour} notitle")
        key = "set key bottom right font ',8'" if i == 0 else "unset key"
        script.append(
            f"set size 0.333,0.36\nset origin {i / 3},0.64\n{key}\nset title '{name}: filled stable, open accurate, dotted refused above'"
        )
        script.append(f"plot {', '.join(lines)}, 1 dt 2 lc 'black' notitle")
    script.append(
        f"set yrange [0.3:{len(places) + 0.7}]\nset xrange [0:2.6]\nset xlabel 'dt c_p/h'\nunset ylabel\nset key bottom left font ',8'"
    )
    for i, alpha in enumerate((0.1, 1.0)):
        index = 3 * len(KERNELS) + i
        left, width = (0.0, 0.6) if i == 0 else (0.6, 0.4)
        tics = "set ytics font ',8'" if i == 0 else "set ytics format ''"
        margin = "set lmargin 38" if i == 0 else "set lmargin 3"
        labels = "2:1:ytic(5)" if i == 0 else "2:1"
        script.append(f"set size {width},0.63\nset origin {left},0\n{tics}\n{margin}\nset title 'alpha {alpha}'")
        script.append(
            f"plot '{data}' index {index} using {labels} with points pt 7 ps 1.2 lc 1 title 'stable', "
            f"'' index {index} using 3:1 with points pt 6 ps 1.2 lc 2 title 'accurate', "
            f"'' index {index} using 4:1 with points pt 2 ps 1 lc 'red' title 'refused above'"
        )
    script.append("unset multiplot\n")
    subprocess.run(["gnuplot"], input="\n".join(script), text=True, check=True)


def percent(x):
    return "failed" if math.isinf(x) else f"{100 * x:.2g} %"


def table(rows):
    """A line for each case and kernel; of each viscosity the stable and the accurate dt c_p/h, and in brackets what is refused."""
    cells = {}
    for r in rows:
        refused = REFUSED * r["limit"]
        stable = f"**{r['stable']:.2f}**" if r["stable"] < 0.999 * refused else f"{r['stable']:.2f}"
        accurate = f"{r['accurate']:.2f}" if r["accurate"] > 0 else "-"
        cells.setdefault((r["case"], r["kernel"], r["h"]), {})[r["alpha"]] = f"{stable} / {accurate} ({refused:.2f})"
    alphas = [a for a in ALPHAS if any(a in cell for cell in cells.values())]
    lines = ["| case | kernel, h | " + " | ".join(f"alpha {a:g}" for a in alphas) + " |", "|" + "---|" * (2 + len(alphas))]
    lines += [
        f"| {case} | {kernel}, {h} | " + " | ".join(cell.get(a, "") for a in alphas) + " |" for (case, kernel, h), cell in cells.items()
    ]
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", help="the program kuzure")
    parser.add_argument("--results", default=os.environ.get("KUZURE_RESULTS", "."), help="directory of step_map.csv and step_map.md")
    parser.add_argument("--figures", help="directory of step_map.png; without it no figure")
    parser.add_argument("--only", default="", help="cases whose name contains this")
    arguments = parser.parse_args()

    os.makedirs(arguments.results, exist_ok=True)
    path = os.path.join(arguments.results, "step_map.csv")
    known = {}
    if os.path.exists(path):
        with open(path) as f:
            for r in csv.DictReader(f):
                r.update({k: float(r[k]) for k in FIELDS[2:]})
                known[(r["case"], r["kernel"], r["h"], r["alpha"])] = r
    measured = Map(arguments.program)
    keys = [(name, *kernel, alpha) for name, case in CASES.items() for kernel in case.kernels for alpha in case.alphas]
    for key in sorted(keys, key=lambda k: ([0.1, 1.0, 0.0, 0.5].index(k[3]), k[1:3] != DEFAULT)):  # what matters most first
        if key in known or arguments.only not in key[0]:
            continue
        r = known[key] = dict(zip(FIELDS, key + measured.measure(CASES[key[0]], *key[1:])))
        with open(path, "a", newline="") as f:
            lines = csv.DictWriter(f, FIELDS, lineterminator="\n")
            if f.tell() == 0:
                lines.writeheader()
            lines.writerow({k: v if isinstance(v, str) else f"{v:.6g}" for k, v in r.items()})
        print(
            f"{key[0]:36} {key[1]:13} h {key[2]} alpha {key[3]:<4} limit {r['limit']:.2f} stable {r['stable']:.2f} accurate "
            f"{r['accurate']:.2f}; residual at 1.0 {percent(r['at_default'])}, at {REFUSED * r['limit']:.2f} {percent(r['at_refused'])}",
            flush=True,
        )
    rows = [known[key] for key in keys if key in known]
    with open(os.path.join(arguments.results, "step_map.md"), "w") as f:
        f.write(table(rows))
    if arguments.figures:
        figure(rows, os.path.abspath(arguments.figures), arguments.results)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    print(f"{measured.runs} runs, {(used.ru_utime + used.ru_stime) / 60:.1f} core-minutes")


if __name__ == "__main__":
    main()
