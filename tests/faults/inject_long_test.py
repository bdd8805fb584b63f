#!/usr/bin/python3
"""Every n-th file operation of a short run fails, with each error, once and for ever. Give a file to keep the record in."""
import json
import sys

from faults import Place, finish
from injections import ERRORS, Campaign


def main():
    with Place("inject") as place:
        record = Campaign(place).every(lambda k, kind: [(e, times) for e in ERRORS[kind] for times in (1, 0)])
        if len(sys.argv) > 2:
            with open(sys.argv[2], "w") as f:
                json.dump(record, f, indent=1)
    finish()


if __name__ == "__main__":
    main()
