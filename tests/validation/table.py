#!/usr/bin/python3
"""Renders every record in $KUZURE_RESULTS/*.jsonl: table.py [PAGE.md], default $KUZURE_RESULTS/verification.md. A page that has
the markers keeps what stands around them.

Any test may write records, in any language: one JSON object a line with the keys case, what, reference, result, unit,
tolerance, passed (true, false or null for a number without a gate), seconds, note and, if it likes, figure and closed: whose
independent number, within 5 % of the result, closes a gate that is missed.
"""
import glob
import json
import os
import sys

from common import COLOURS, FIGURES, RESULTS, figure
from known import MISSES

# What the names of curves say of the correction of gradients.
HOW_CORRECTED = {"_corrected": ", corrected gradient", "_adjoint": ", forces too"}
# Between these two lines of a page stands what is rendered; the rest of the page is written by hand.
BEGIN, END = "<!-- measured -->\n", "<!-- end -->"

# What each case is and what its numbers say.
ABOUT = {
    "V-EXP-1": """Aluminium bars, 200 x 100 mm, plane strain (Bui et al. 2008, digitised under an MIT licence).
The surface is measured twice: by volume in columns of four spacings, and by the highest bar.
The friction of 19.8 deg is that of a shear box, so 3 alpha = tan 19.8 deg (cone "shear"); the older criterion took the plane-strain cone, which is 8 % weaker.
The compression cone of the paper (its phi of 19.8 deg acts like 26.2 deg in plane strain) stops visibly short, as predicted: it is a control.
The toe moves with the artificial viscosity, and with E, which is consistent with a viscosity that goes with the wave speed: E x 4 and alpha x 2 shorten it alike.""",
    "V-EXP-3": """Columns of glass beads, a = H0/L0, released at once on a rough floor, with 3 alpha = tan of the angle at which these beads start to flow, 27.4 deg (Rousseau et al. 2023).
With the angle at which they stop, 22.2 deg, they run nearly half as far again: both this program and an independent MPM code say so, and the numbers of both are in the rows "stop angle".
The exponents are those of a frictional continuum, in which tall columns run too far (Kumar 2015): neither code has the collisions that dissipate, nor side walls.
Below the break the linear law holds only while a part of the top stays where it was, up to a = 0.7.
Fronts are good to about 0.1 L0 at 20 spacings: by so much runs differ that differ in the last bit.""",
    "V-EXP-4": """A 2:1 slope by strength reduction, one run for each factor: K0 start, two seconds of critical damping, then free.
A slope fails when its greatest displacement bends upwards in the first second.
The chart is of associated flow, and associated flow (psi = phi, the plane-strain cone) meets it.
Without dilation a plane of sliding carries less, and the factor lies between that times cos(phi_e) and that (Davis 1968), for each cone by itself.
The first criterion tried, "moved more than 0.05 H", is in the notes: slopes that slump a little and stop in a flatter shape passed as stable by it.""",
    "V-EXP-5": """A cohesive block whose crest is torn: tensile instability.
Clumps are neighbours closer than 0.6 spacings.
The gates are on the kernel of the defaults; those of the cubic spline, for which they were first written, stand beside.""",
    "ablation": """Cost of a step: interleaved shortened runs, with over without, ratio of the medians of five each.
Measured on a quiet machine: below about 5 % it is noise.
The answers come from one full run each.
Stress noise: RMS of the vertical stress against its neighbourhood's average.
What it teaches: artificial stress is paid for and changes nothing in dry soil; stress diffusion takes the noise out of level ground but pushes a slope that stands (its static part is that of level ground), so "auto" leaves it off there and check warns of it.""",
}


def rows():
    cases = {}
    for file in sorted(glob.glob(os.path.join(RESULTS, "*.jsonl"))):
        with open(file) as f:
            for line in f:
                if line.strip():
                    row = json.loads(line)
                    # a test that ran again replaces its earlier record
                    cases.setdefault(row["case"], {})[row["what"]] = row
    return cases


def number(value):
    if value is None:
        return "-"
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def quantity(row):
    """The reference with its unit."""
    return cell(f"{number(row['reference'])} {row['unit'] if row['unit'] != '1' else ''}".strip())


def cell(text):
    return str(text).replace("|", "\\|").replace("\n", " ")


def render(page, cases):
    """Tables as text; figures are linked relative to where the page will stand."""
    folder = os.path.relpath(FIGURES, os.path.dirname(os.path.abspath(page)))
    gates = [r for c in cases.values() for r in c.values() if r["passed"] is not None and r["tolerance"] != "reported"]
    closed = [r for r in gates if not r["passed"] and r.get("closed")]
    missed = [r for r in gates if not r["passed"] and not r.get("closed")]
    text = [
        f"{len(gates)} gates, {len(gates) - len(missed) - len(closed)} met, {len(closed)} closed, {len(missed)} missed; "
        f"{sum(len(c) for c in cases.values())} rows.",
        "",
    ]
    if closed:
        text += ["| code | closed gate | reference, tolerance | result | independent number |", "|---|---|---|---|---|"]
        text += [
            f"| {r['case']} | {cell(r['what'])} | {quantity(r)}, {cell(r['tolerance'])} | {number(r['result'])} | {cell(r['closed'])} |"
            for r in closed
        ]
        text.append("")
    if missed:
        text += ["| code | missed gate | reference, tolerance | result | why |", "|---|---|---|---|---|"]
        text += [
            f"| {r['case']} | {cell(r['what'])} | {quantity(r)}, {cell(r['tolerance'])} | {number(r['result'])} | "
            f"{cell(MISSES.get((r['case'], r['what'])) or r.get('note') or 'not understood yet')} |"
            for r in missed
        ]
        text.append("")
    text += ["| code | what | reference | result | unit | tolerance | pass | s | note |", "|---|---|---|---|---|---|---|---|---|"]
    more, figures = [], []
    for name, content in cases.items():
        about = f"**{name}**: {ABOUT[name].strip()}\n" if name in ABOUT else ""
        table = os.path.join(RESULTS, name + ".md")
        if os.path.exists(table):  # a case that lays out its own
            with open(table) as f:
                more.append((about or f"**{name}**\n") + "\n" + f.read().strip() + "\n")
            continue
        if about:
            more.append(about)
        for r in content.values():
            verdict = "closed" if r.get("closed") else {None: "", True: "yes", False: "**missed**"}[r["passed"]]
            text.append(
                f"| {name} | {cell(r['what'])} | {cell(number(r['reference']))} | {cell(number(r['result']))} | {cell(r['unit'])} | {cell(r['tolerance'])} | "
                f"{verdict} | {r.get('seconds') or 0:.3g} | {cell(r.get('note', ''))} |"
            )
        for figure in sorted({r["figure"] for r in content.values() if r.get("figure")}):
            if os.path.exists(os.path.join(FIGURES, figure)):
                figures.append(f"![{name}]({os.path.join(folder, figure)})\n")
    return "\n".join([*text, "", *more, *figures]).rstrip() + "\n"


def page_with(page, text):
    """The page with the text between its markers, or a page of its own."""
    if os.path.exists(page):
        with open(page) as f:
            old = f.read()
        if BEGIN in old and END in old.split(BEGIN, 1)[1]:
            before, rest = old.split(BEGIN, 1)
            return before + BEGIN + text + END + rest.split(END, 1)[1]
    return "# Measured\n\n" + text


def draw_closed_forms():
    """Figures of the C++ cases, from the curves they leave; gives {case: figure} of those there are."""
    drawn = {}
    column = os.path.join(RESULTS, "SPH-7_stress.csv")
    if os.path.exists(column):
        drawn["SPH-7"] = figure(
            "column_at_rest",
            f"""set xlabel 'stress (kPa)'; set ylabel 'height (m)'; set key left top
set title 'elastic column at rest, 10 and 50 spacings'
plot '{column}' every ::1 using ($5/1e3):2 with lines lw 2 lc rgb '#000000' title 'closed form, -rho g d', \\
  '' every ::1 using ($1==10?$3/1e3:NaN):2 pt 7 ps 1.0 lc rgb '{COLOURS[1]}' title 'sigma_z, 10 spacings', \\
  '' every ::1 using ($1==50?$3/1e3:NaN):2 pt 7 ps 0.5 lc rgb '{COLOURS[0]}' title 'sigma_z, 50 spacings', \\
  '' every ::1 using ($1==50?$4/1e3:NaN):2 pt 7 ps 0.5 lc rgb '{COLOURS[2]}' title 'sigma_x, 50 spacings'
""",
        )
    tips = {}
    for path in sorted(glob.glob(os.path.join(RESULTS, "SPH-5*_tip_*_0.05_0.3*.csv"))):
        tips[
            int(os.path.basename(path).split("_tip_")[1].split("_")[0]),
            next((words for word, words in HOW_CORRECTED.items() if word in path), ""),
        ] = path
    if tips:
        spacings, hows = sorted({n for n, _ in tips}), ["", *HOW_CORRECTED.values()]
        lines = ", ".join(
            f"'{p}' every ::1 using 1:(1e3*$2) with lines lw 2 dt {1 + hows.index(c)} lc rgb '{COLOURS[spacings.index(n)]}' "
            f"title 'H/dx = {n}{c}'"
            for (n, c), p in sorted(tips.items())
        )
        drawn["SPH-5"] = figure(
            "swinging_plate",
            f"""set xlabel 'time (s)'; set ylabel 'deflection of the tip (mm)'; set key center bottom
set title 'plate thrown with 0.05 c_0; thin plate: T = 0.2540 s'
set arrow from 0.127,graph 0 to 0.127,graph 1 nohead dt 2; set label 'T/2' at 0.129,graph 0.95
plot {lines}
""",
        )
    return drawn


def main(page):
    cases = rows()
    for name, picture in draw_closed_forms().items():
        for row in list(cases.get(name, {}).values())[:1]:
            row["figure"] = picture
    text = page_with(page, render(page, cases))
    with open(page, "w") as f:
        f.write(text)
    print(page)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else os.path.join(RESULTS, "verification.md"))
