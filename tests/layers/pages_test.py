#!/usr/bin/python3
"""ARCHITECTURE.md and CONTRIBUTING.md name only what is there: every path, file and name of the code in back-quotes, every link and its
heading; and the first is two pages. Run as pages_test.py PROGRAM (which is not used)."""
import os
import re
import sys
from pathlib import Path

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, root

ROOT = Path(root)
PAGES = ["ARCHITECTURE.md", "CONTRIBUTING.md"]
FOLDERS = ["solver", "decomposition", "io", "perf", "python", "jobs", "tests", "docs", "cmake"]
CODE = {".hpp", ".cpp", ".py", ".sh"}
# Foreign headers, and what a page only stands in for: NAME.toml, SYSTEM.job.sh, More...
FOREIGN = {"mpi.h", "metis.h", "hdf5.h"}
STANDS_IN = re.compile(r"\b(NAME|SYSTEM|NoX)\b")
MOST_WORDS = 1300
COMMANDS = ("kuzure ", "clang-format", "grep ", "git ", "cmake ", "ctest ", "--")


def tree():
    """All files as paths from the root, and every word of the code and the build."""
    files = [f for folder in FOLDERS for f in (ROOT / folder).rglob("*") if f.is_file() and "__pycache__" not in f.parts]
    files += [f for f in ROOT.iterdir() if f.is_file()]
    words = set()
    for f in files:
        if (f.suffix in CODE or f.name == "CMakeLists.txt") and "tests/layers/pages_test.py" not in f.as_posix():
            words |= set(re.findall(r"\w+", f.read_text(errors="replace")))
    return {f.relative_to(ROOT).as_posix() for f in files}, words


def exists(path, files):
    """A file or folder from the top or from solver/; without an ending also a header with its source."""
    path = path.removeprefix("./").rstrip("/")
    for base in ("", "solver/"):
        whole = base + path
        if whole in files or any(f.startswith(whole + "/") for f in files) or {whole + ".hpp", whole + ".cpp"} <= files:
            return True
    return False


def faults(text, files, words):
    """What a page names in back-quotes that is not there."""
    for k, line in enumerate(re.sub(r"^```.*?^```", lambda m: "\n" * m[0].count("\n"), text, flags=re.M | re.S).splitlines(), 1):
        for quoted in re.findall(r"`([^`]+)`", line):
            if quoted.startswith(COMMANDS):
                parts = [p for p in quoted.split() if "/" in p and not p.startswith("-")]
            else:
                parts = [quoted]
            for part in parts:
                if part in FOREIGN or STANDS_IN.search(part):
                    continue
                named = re.fullmatch(r"[\w.-]+\.(hpp|cpp|py|sh|md|toml|txt)", part)
                if "/" in part and not part.startswith("'"):
                    if not exists(part, files):
                        yield f"{k}: `{part}` is no file or folder"
                elif named:
                    if part not in files and not any(f.endswith("/" + part) for f in files):
                        yield f"{k}: `{part}` is no file"
                else:
                    for name in re.findall(r"[A-Za-z_]\w+", part):
                        if name not in words and not exists(name, files):
                            yield f"{k}: `{part}`: the code has no {name}"


def headings(text):
    return {re.sub(r"[^\w\- ]", "", h.lower()).replace(" ", "-") for h in re.findall(r"^#+ (.*)$", text, re.M)}


def broken_links(page, read):
    for target in re.findall(r"\]\(([^)]+)\)", read(page)):
        file, _, anchor = target.partition("#")
        if file and not (ROOT / file).exists():
            yield f"{page}: no {file}"
        elif anchor and anchor not in headings(read(file or page)):
            yield f"{page}: {target}: no such heading"


def main():
    read = lambda name: (ROOT / name).read_text()
    files, words = tree()
    planted = "see `solver/run/simulation.hpp`, `run/watch`, `Simulation::step`, `core/field.hpp`\n"
    check(not list(faults(planted, files, words)), f"what is there is found: {list(faults(planted, files, words))}")
    for wrong in ("`solver/run/nowhere.hpp`", "`run/nowhere`", "`nowhere_at_all.py`", "`Simulation::no_such_name_at_all`"):
        check(list(faults(f"\n{wrong}\n", files, words)), f"a planted {wrong} is noticed")
    for page in PAGES:
        found = list(faults(read(page), files, words)) + list(broken_links(page, read))
        check(not found, f"{page} names what is there: {found}")
    count = len(read("ARCHITECTURE.md").split())
    check(count <= MOST_WORDS, f"ARCHITECTURE.md is two pages: {count} words, at most {MOST_WORDS}")
    finish()


if __name__ == "__main__":
    main()
