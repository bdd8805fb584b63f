#!/usr/bin/python3
"""Doxygen makes the pages of the C++ API (docs/cpp.md) without a warning: every public name of it is described. Run as doxygen_test.py
PROGRAM (which is not used); not run (77) without doxygen."""
import os
import shutil
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, root, scratch

CONFIGURATION = (Path(root) / "docs/Doxyfile").read_text()


def pages(tree):
    """What doxygen says, and its exit code, in a tree of its own."""
    done = subprocess.run(["doxygen", "-"], input=CONFIGURATION, capture_output=True, text=True, cwd=tree, timeout=300)
    return done.returncode, (done.stdout + done.stderr).strip()


def main():
    if not shutil.which("doxygen"):
        print("not run: doxygen is not there; jobs/install.sh builds installs it")
        sys.exit(77)
    tree = Path(scratch("doxygen"))
    shutil.copytree(Path(root) / "solver/api", tree / "solver/api")
    (tree / "build").mkdir()
    code, said = pages(tree)
    check(code == 0 and not said, f"no warning: {said[-1000:]}")
    check((tree / "build/doxygen/html/classkuzure_1_1api_1_1Simulation.html").exists(), "Simulation has its page")
    header = tree / "solver/api/simulation.hpp"
    header.write_text(header.read_text().replace("    /// The present time, s.\n", ""))
    code, said = pages(tree)
    check(code != 0 and "time" in said, f"a member that nothing is said of is a warning: {said[-200:]}")
    finish()


if __name__ == "__main__":
    main()
