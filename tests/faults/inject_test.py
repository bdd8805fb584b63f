#!/usr/bin/python3
"""Every n-th file operation of a short run fails, the errors in turn; reads too, and each n with each error: inject_long_test.py."""
from faults import Place, check, finish
from injections import ERRORS, Campaign


def main():
    with Place("inject") as place:
        record = Campaign(place).every(lambda k, kind: [] if kind == "read" else [(ERRORS[kind][k % len(ERRORS[kind])], (k // 2) % 2)])
        check(record["injected"] >= 150 and record["exit 4"] > record["exit 0"], f"{record}")
    finish()


if __name__ == "__main__":
    main()
