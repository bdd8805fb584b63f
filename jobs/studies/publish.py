#!/usr/bin/python3
"""From the studies' results to what is kept of them: tables and figures of docs/accuracy.md, and the table behind `kuzure check --accuracy`.

publish.py RESULTS: the directory in which jobs/studies/run.sh left a directory for each study. Tables go between the page's
markers; solver/app/study/measured.inl gets the curves of kuzure's own presets, and only self-references: the distance to an
experiment holds the model's error too, which no spacing mends.
"""
import json
import re
import shutil
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
STUDIES = ("k0_column", "aluminium_bars", "cylinder", "hirata")
PRESETS = ("seed", "fast", "standard", "accurate")


def percent(x, signed=False):
    return "-" if x is None else f"{100 * x:{'+' if signed else ''}.2f} %"


def errors_table(study):
    measures = list(study["measures"])
    out = [
        "| settings | spacing (m) | particles | steps | work | core-seconds | " + " | ".join(measures) + " |",
        "|---" * (6 + len(measures)) + "|",
    ]
    for p in study["points"]:
        if p["choice"]:
            continue
        if p["exit_code"] != 0:
            out.append(
                f"| {p['curve']} | {p.get('spacing', 0):g} | {p.get('message', '')[:80] if p['exit_code'] > 0 else 'not run'} |"
                + " |" * (3 + len(measures))
            )
            continue
        cells = [percent(p["errors"][m]) for m in measures]
        out.append(
            f"| {p['curve']} | {p['spacing']:g} | {p['particles']} | {p['steps']} | {p['work']:.3g} | {p['core_seconds']:.1f} | "
            + " | ".join(cells)
            + " |"
        )
    return out


def choices_table(study):
    rows = [p for p in study["points"] if "against_base" in p]
    if not rows:
        return []
    measures = [m for m in study["measures"] if any(p["against_base"].get(m) is not None for p in rows)]
    base = next(p for p in study["points"] if p["choice"] and p["curve"] == "base")
    out = [
        f"Each choice against the base (`standard`, spacing {base['spacing']:g} m, {base['core_seconds']:.1f} core-seconds): time and work as ratios, errors as changes.",
        "",
        "| choice | time | work | " + " | ".join(measures) + " |",
        "|---" * (3 + len(measures)) + "|",
        "| base | 1 | 1 | " + " | ".join(percent(base["errors"][m]) for m in measures) + " |",
    ]
    for p in rows:
        a = p["against_base"]
        out.append(
            f"| {p['curve']} | {a['core_seconds']:.2f} | {a['work']:.2f} | " + " | ".join(percent(a[m], True) for m in measures) + " |"
        )
    return out


def notes(study):
    out = [f"- {m}: errors count from {r['from']}" for m, r in study["measures"].items()]
    for c in study["curves"]:
        for m in study["measures"]:
            entry = c.get(m) or {}
            if entry.get("no_extrapolation"):
                out.append(f"- no extrapolation of {m} along `{c['curve']}`: {entry['no_extrapolation']}")
    return out


def bars_table(studies):
    out = ["| scene | settings | spacing (m) | measure | error bar | true error | covered | half-width/true error |", "|---" * 8 + "|"]
    count = covered = narrow = none = 0
    for study in studies.values():
        for b in study["error_bars"]:
            head = f"| {study['title'].split(',')[0]} | {b['curve']} | {b['spacing']:g} | {b['measure']} | "
            if "no_interval" in b:
                none += 1
                out.append(head + f"none: {b['no_interval']} | | | |")
                continue
            count += 1
            covered += b["covers"]
            narrow += b["half_width_over_error"] <= 3
            out.append(
                head
                + f"{b['value']:.4g} +- {b['half_width']:.2g} | {b['value'] - b['truth']:+.2g} | {'yes' if b['covers'] else '**no**'} | {b['half_width_over_error']:.2f} |"
            )
    return [
        f"{count} intervals: {covered} cover the reference, {narrow} are at most 3 times the true error wide; {none} times no interval was given.",
        "",
    ] + out


def between(text, name, lines):
    pattern = re.compile(rf"(<!-- {name} -->\n).*?(<!-- end -->)", re.S)
    if not pattern.search(text):
        sys.exit(f"docs/accuracy.md: no marker <!-- {name} -->")
    return pattern.sub(lambda m: m[1] + "\n".join(lines) + "\n" + m[2], text)


def curves(study):
    about = study["about"]
    for measure, reference in study["measures"].items():
        if measure in ("residual", "settlement") or reference["from"].startswith(("experiment", "none")):
            continue
        # At the spacing of the run that errors count from, they say how near the presets are to each other, not to the truth.
        coarser_than = reference["spacing"] * (1 + 1e-9)
        for preset in PRESETS:
            points = [
                (about["height"] / p["spacing"], p["errors"][measure])
                for p in study["points"]
                if p["spacing"] > coarser_than and p["curve"] == preset and not p["choice"] and p["exit_code"] == 0 and p["errors"][measure]
            ]
            if len(points) >= 2:
                yield {
                    "scene": study["title"].split(",")[0],
                    "measure": measure,
                    "preset": preset,
                    "about": {k: round(about[k], 4) for k in ("dimensions", "slenderness", "friction_angle", "cohesion")},
                    "points": [[float(f"{n:.5g}"), float(f"{e:.4g}")] for n, e in sorted(points)],
                }


def main():
    results = Path(sys.argv[1])
    studies = {
        name: json.loads((results / name / "study.json").read_text()) for name in STUDIES if (results / name / "study.json").exists()
    }
    page = ROOT / "docs/accuracy.md"
    text = page.read_text()
    for name, study in studies.items():
        text = between(text, name, errors_table(study) + [""] + choices_table(study) + [""] + notes(study))
        for figure in (results / name / "figures").glob("*"):
            kept = figure.stem in (f"error_{next(iter(study['measures'])).replace(' ', '_').replace('-', '_')}", "choices")
            if kept and figure.suffix in (".png", ".svg"):
                shutil.copy(figure, ROOT / "docs/figures" / f"accuracy_{name}_{figure.stem.split('_')[0]}{figure.suffix}")
    page.write_text(between(text, "error bars", bars_table(studies)))
    rows = ",\n".join(json.dumps(row) for study in studies.values() for row in curves(study))
    (ROOT / "solver/app/study/measured.inl").write_text(
        f'// Made by jobs/studies/publish.py from the studies of docs/accuracy.md: errors by layers of particles. Not to be edited.\nR"json([\n{rows}\n])json"\n'
    )
    print(f"{', '.join(studies)}: docs/accuracy.md, docs/figures/accuracy_*, solver/app/study/measured.inl")


if __name__ == "__main__":
    main()
