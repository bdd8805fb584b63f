#!/usr/bin/python3
"""The whole restart matrix. As restart_long_test.py PROGRAM FILE.json the hashes are written there."""
import json
import sys

from faults import finish
from matrix import matrix


def main():
    ranks = (1, 2, 3, 4, 7)
    hashes, calm = matrix([(b, a) for b in ranks for a in ranks])
    if len(sys.argv) > 2:
        with open(sys.argv[2], "w") as f:
            json.dump({"undisturbed": calm, "restarts": hashes}, f, indent=1)
    finish()


if __name__ == "__main__":
    main()
