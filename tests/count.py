#!/usr/bin/python3
"""Counts what ctest's JUnit file says: "GOOD BAD NAMES-NOT-RUN". Run as count.py FILE.

Everything that ran to no success counts as bad, also what was not found or not finished. Only a test that ended with 77 itself is neither:
it said that a tool it needs is not on this machine."""
import sys
import xml.etree.ElementTree as tree


def count(path):
    good, bad, without = 0, 0, []
    for case in tree.parse(path).getroot().iter("testcase"):
        skipped = case.find("skipped")
        if case.get("status") == "run":
            good += 1
        elif skipped is not None and skipped.get("message") == "SKIP_RETURN_CODE=77":
            words = (case.findtext("system-out") or "").strip().splitlines()
            said = next((line.removeprefix("not run: ") for line in words if line.startswith("not run: ")), "".join(words[:1]))
            without.append(f"{case.get('name')} ({said})")
        else:
            bad += 1
    return good, bad, without


if __name__ == "__main__":
    good, bad, without = count(sys.argv[1])
    print(good, bad, ", ".join(without))
