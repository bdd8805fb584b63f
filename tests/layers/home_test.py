#!/usr/bin/python3
"""The files that a stranger looks for: one version everywhere, a workflow that runs what README says, links and commands that are there.
Run as home_test.py PROGRAM (which is not used)."""
import json
import os
import re
import sys
from pathlib import Path

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, root

ROOT = Path(root)


def versions(read):
    """Every version that a file states, by file."""
    found = {
        "CMakeLists.txt": r"project\(kuzure VERSION ([\d.]+)",
        "CITATION.cff": r"^version: ([\d.]+)$",
        "CHANGELOG.md": r"^## (\d+\.\d+\.\d+)",
        "python/pyproject.toml": r'^version = "([\d.]+)"',
        "python/kuzure/__init__.py": r'^__version__ = "([\d.]+)"',
    }
    return {file: (re.search(pattern, read(file), re.M) or [None, None])[1] for file, pattern in found.items()}


def main():
    read = lambda name: (ROOT / name).read_text()
    stated = versions(read)
    check(len(set(stated.values())) == 1 and None not in stated.values(), f"one version: {stated}")
    other = versions(lambda name: read(name).replace("0.1.0", "0.2.0") if name == "CITATION.cff" else read(name))
    check(len(set(other.values())) == 2, "another one in one of the files would be seen")

    command = re.search(r"^(\./tests/run\.sh)\b", read("README.md"), re.M)[1]
    workflow = read(".github/workflows/tests.yml")
    check(
        re.search(rf"^\s+- run: {re.escape(command)}$", workflow, re.M) and (ROOT / command).exists(),
        f"the workflow runs README's {command}",
    )
    check("exec" in read(".ci/run") and "tests/run.sh" in read(".ci/run"), "and so does .ci/run")
    container = json.loads(read(".devcontainer/devcontainer.json"))
    scripts = re.findall(r"jobs/\w+\.sh", container["postCreateCommand"] + read("CONTRIBUTING.md") + read(".clangd"))
    check(len(scripts) >= 4 and all((ROOT / s).exists() for s in scripts), f"scripts that are named are there: {scripts}")
    for form in ("fault", "wish"):
        text = read(f".github/ISSUE_TEMPLATE/{form}.yml")
        check(
            re.match(r"name: .+\ndescription: .+\nbody:\n", text) and "\t" not in text and text.count("- type: ") == text.count("id: "),
            f"form {form}",
        )
    citation = read("CITATION.cff")
    check(
        all(re.search(rf"^{key}:", citation, re.M) for key in ("cff-version", "message", "title", "authors")),
        "CITATION.cff has what it must",
    )
    check("## Unreleased" in read("CHANGELOG.md"), "CHANGELOG.md has a place for what comes")
    finish()


if __name__ == "__main__":
    main()
