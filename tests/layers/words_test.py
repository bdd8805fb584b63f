#!/usr/bin/python3
"""One word, one meaning (CONTRIBUTING.md): names of the C++ code use these words where their one meaning is at home, and nowhere else. Run
as words_test.py PROGRAM (which is not used)."""
import os
import re
import sys
from pathlib import Path

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, root

ROOT = Path(root)
# A word: paths where names may hold it, and names that may be anywhere.
HOMES = {
    "look": (r"", r""),
    "sweep": (r"io/sweep_file|solver/app/(study/|commands/study)|tests/unit/study_test|tests/fuzz/profiles_fuzz", r""),
    "twin": (
        r"solver/app/(run|study|report)/|solver/app/commands/run|solver/app/hazard/run_scene|tests/unit/study_test|tests/fuzz/profiles_fuzz",
        r"",
    ),
    "cut": (
        r"decomposition/|solver/run/(balance|blocks|retry|scaling)|solver/app/(scaling/|commands/scale)|tests/mpi/|tests/unit/predict_test",
        r"recut_every_?|cut_(start|state)|cuts",
    ),
    "place": (r"io/|solver/app/|tests/", r"placed?|place_walls"),
    "rest": (r"solver/app/study/|tests/", r"\w*(at_rest|AtRest|to_rest)\w*|all_rest|rests?"),
    "row": (
        r"io/|perf/|solver/app/|solver/scene/(contour|draped|height_field|map_grid|events|event_rules|shape)|solver/run/map_record|tests/",
        r"row|rows",
    ),
}


def names(text):
    """Names of C++ code without its comments and texts, each with its line."""
    plain = re.sub(r"//[^\n]*|/\*.*?\*/|R\"(\w*)\(.*?\)\1\"|\"(?:[^\"\\\n]|\\.)*\"", lambda m: "\n" * m[0].count("\n"), text, flags=re.S)
    for k, line in enumerate(plain.splitlines(), 1):
        if not line.lstrip().startswith("#"):
            for name in re.findall(r"\b(?!MPI_)[A-Za-z_]\w*", line):
                yield k, name


def words_of(name):
    """LongName, long_name_ -> long, name; without the s of many."""
    parts = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)
    return {part.lower().removesuffix("s") for part in parts}


def strays(path, text):
    for k, name in names(text):
        for word in words_of(name) & HOMES.keys():
            home, anywhere = HOMES[word]
            if not (home and re.match(home, path)) and not re.fullmatch(anywhere or "-", name):
                yield f'{path}:{k}: {name}: "{word}" means something else here: CONTRIBUTING.md, one word, one meaning'


def main():
    planted = 'int half_twin; // twin\nauto s = "twin"; double LatticeRows;\n'
    found = list(strays("solver/kernels/x.hpp", planted))
    check(len(found) == 2 and ":1: half_twin" in found[0] and ":2: LatticeRows" in found[1], f"planted names are found: {found}")
    check(not list(strays("solver/app/study/x.hpp", "Twin twin_runs;")), "and not where they are at home")
    files = [f for folder in ("solver", "decomposition", "io", "perf", "tests") for f in sorted((ROOT / folder).rglob("*.?pp"))]
    found = [s for f in files for s in strays(f.relative_to(ROOT).as_posix(), f.read_text(errors="replace"))]
    check(len(files) > 300 and not found, f"each word where it is at home, in {len(files)} files" + "".join(f"\n  {s}" for s in found))
    page = (ROOT / "CONTRIBUTING.md").read_text()
    check(all(f"\n| *{word}* |" in page for word in HOMES), "CONTRIBUTING.md says of each word what it means")
    finish()


if __name__ == "__main__":
    main()
