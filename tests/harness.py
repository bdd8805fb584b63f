"""What the Python tests share: the program under test, checks that are counted, the end. Nothing here is a test.

A test in a folder below puts this one on its path: sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
"""
import os
import sys

program = os.path.abspath(sys.argv[1])
root = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
failures = []


def check(good, what):
    """Says what holds and what does not, and gives it back; a test goes on, and fails at its end."""
    print(("ok    " if good else "FAIL  ") + what, flush=True)
    if not good:
        failures.append(what)
    return good


def finish():
    """How many checks failed, and the exit code of the test."""
    print(f"{len(failures)} failures")
    sys.exit(1 if failures else 0)
