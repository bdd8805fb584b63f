#!/usr/bin/python3
"""The map of stable steps: the largest Courant number dt c_p/h at which a run keeps its energy, by bisection, for a bar, a
column and a collapse, over viscosity, kernel and smoothing length.

    perf/step_map.py PROGRAM [FIGURE-DIRECTORY]

Stable: the run ends by itself (exit 0) and its energy residual stays within 2 % of the largest energy at every row of its history.
Writes step_map.csv to $KUZURE_RESULTS (or the working directory), where it also finds what an earlier call has done, and step_map.png to the figure directory."""
import csv, math, os, shutil, subprocess, sys, tempfile

program = os.path.abspath(sys.argv[1])
figures = os.path.abspath(sys.argv[2]) if len(sys.argv) > 2 else None
results = os.environ.get("KUZURE_RESULTS", ".")
DX, E, NU, RHO = 0.02, 1.8e6, 0.3, 1850.0
C_P = math.sqrt(E * (1 - NU) / ((1 + NU) * (1 - 2 * NU)) / RHO)

SCENE = """title = "stable step, {name}"
dimensions = 2
[space]
spacing = {dx}
h = {h}
{space}
[time]
end = {end}
step = {step}
[soil.s]
density = {rho}
young = {E}
poisson = {nu}
{strength}
[[body]]
soil = "s"
{body}
[[wall]]
{wall}
[effects]
{effects}
[accuracy]
kernel = "{kernel}"
[output]
history = {rows}
"""
CASES = {
    # an elastic bar that hits a wall with 1 m/s and rings: the P-wave alone
    "bar": dict(end=0.3, strength="cohesion = 1.0e9\nfriction_angle = 0.0\ntension_cutoff = 1.0e9",
                space='low = [0.0, 0.0, -1.0]\nhigh = [0.2, 0.0, 4.0]\nperiodic = ["x"]',
                body="box = { low = [0.0, 0.0, 0.0], high = [0.2, 0.0, 1.0] }\nvelocity = [0.0, 0.0, -1.0]",
                wall="box = { low = [0.0, 0.0, -0.12], high = [0.2, 0.0, 0.0] }", gravity=None),
    # a column under sudden gravity: weight, free surface, yield
    "column": dict(end=0.5, strength='friction_angle = 25.0\ncone = "plane strain"',
                   space='low = [0.0, 0.0, -1.0]\nhigh = [0.2, 0.0, 4.0]\nperiodic = ["x"]',
                   body="box = { low = [0.0, 0.0, 0.0], high = [0.2, 0.0, 1.0] }",
                   wall="box = { low = [0.0, 0.0, -0.12], high = [0.2, 0.0, 0.0] }", gravity=9.81),
    # a collapse: disorder, spray, impact on the floor
    "collapse": dict(end=0.6, strength='friction_angle = 25.0\ncone = "plane strain"', space="",
                     body="box = { low = [0.0, 0.0, 0.0], high = [0.4, 0.0, 0.6] }",
                     wall="box = { low = [-2.0, 0.0, -0.12], high = [2.4, 0.0, 0.0] }", gravity=9.81),
}
KERNELS = [("cubic spline", 1.2), ("cubic spline", 1.3), ("wendland c2", 1.5), ("wendland c4", 1.8)]
ALPHAS = [0.0, 0.05, 0.1, 0.5, 1.0]


def stable(case, kernel, h, alpha, courant):
    c = CASES[case]
    effects = [f"gravity = [0.0, 0.0, {-c['gravity']}]"] if c["gravity"] else []
    if alpha > 0:
        effects.append(f"viscosity = {{ alpha = {alpha}, beta = 0.0 }}")
    step = courant * h * DX / C_P
    work = tempfile.mkdtemp(prefix="kuzure-step-")
    try:
        scene = os.path.join(work, "s.toml")
        with open(scene, "w") as f:
            f.write(SCENE.format(name=case, dx=DX, h=h, step=step, rho=RHO, E=E, nu=NU, kernel=kernel, effects="\n".join(effects), rows=c["end"] / 50,
                                 **{k: c[k] for k in ("space", "end", "strength", "body", "wall")}))
        done = subprocess.run([program, "run", scene, "-o", os.path.join(work, "o"), "--force-step", "--quiet", "--threads", "1"],
                              capture_output=True, text=True, timeout=300)
        if done.returncode not in (0, 3):
            sys.exit(f"{case}: exit {done.returncode}: {done.stderr}")
        if done.returncode == 3:
            return False
        with open(os.path.join(work, "o", "history.csv")) as f:
            rows = [dict(zip(names, map(float, r))) for names, r in zip(iter(lambda: HEADER, None), list(csv.reader(f))[2:])]
        scale, start = 0.0, None
        for r in rows:
            total = sum(r[k] for k in ("kinetic", "potential", "elastic", "plastic", "viscous", "wall", "damping"))
            start = total if start is None else start
            scale = max(scale, r["kinetic"], r["elastic"], abs(r["potential"]))
            if r["time"] > 0.2 * c["end"] and abs(total - start) > 0.02 * scale:
                return False
        return True
    finally:
        shutil.rmtree(work, ignore_errors=True)


HEADER = "time step dt kinetic potential elastic plastic viscous wall damping residual max_speed height front_min_x front_max_x front_min_y front_max_y".split()


def largest(case, kernel, h, alpha):
    low, high = 0.05, 1.6
    if not stable(case, kernel, h, alpha, low):
        return 0.0
    while high / low > 1.06:
        middle = math.sqrt(low * high)
        if stable(case, kernel, h, alpha, middle):
            low = middle
        else:
            high = middle
    return low


table = os.path.join(results, "step_map.csv")  # what it holds already is not done again
known = {}
if os.path.exists(table):
    with open(table) as f:
        known = {(r["case"], r["kernel"], float(r["h"]), float(r["alpha"])): float(r["courant"]) for r in csv.DictReader(f)}
rows = []
for case in CASES:
    for kernel, h in KERNELS:
        for alpha in ALPHAS:
            c = known.get((case, kernel, h, alpha))
            if c is None:
                c = largest(case, kernel, h, alpha)
            rows.append((case, kernel, h, alpha, c))
            print(f"{case:9} {kernel:13} h {h} alpha {alpha:<5} largest stable dt c_p/h {c:.2f}", flush=True)
with open(table, "w") as f:
    f.write("case,kernel,h,alpha,courant\n")
    f.writelines("%s,%s,%g,%g,%.3f\n" % r for r in rows)
if figures:
    data = os.path.join(results, "step_map.dat")
    with open(data, "w") as f:
        for case in CASES:
            for kernel, h in KERNELS:
                f.writelines(f"{a} {c}\n" for (k, n, hh, a, c) in rows if (k, n, hh) == (case, kernel, h))
                f.write("\n\n")
    plots = []
    for i, case in enumerate(CASES):
        lines = ", ".join(f"'{data}' index {i * len(KERNELS) + j} using 1:2 with linespoints pt 7 ps 0.8 lw 2 title '{k}, h {h}'"
                          for j, (k, h) in enumerate(KERNELS))
        plots.append(f"set title '{case}'\nplot {lines}, 0.2 dt 2 lc 'black' title 'default accuracy.cfl', 0.3 dt 3 lc 'red' title 'warned of above', 0.6 dt 4 lc 'red' title 'refused above'")
    script = (f"set terminal pngcairo size 1200,420 font 'sans,10'\nset output '{figures}/step_map.png'\nset multiplot layout 1,3\n"
              "set xlabel 'artificial viscosity alpha'\nset ylabel 'largest stable dt c_p/h'\nset yrange [0:1.2]\nset xrange [-0.03:1.03]\n"
              "set key top right font ',8'\nset grid\n" + "\n".join(plots) + "\nunset multiplot\n")
    subprocess.run(["gnuplot"], input=script, text=True, check=True)
