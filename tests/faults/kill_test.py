#!/usr/bin/python3
"""Twelve kills; two hundred of them: kill_long_test.py."""
from faults import check, finish
from kills import campaign


def main():
    record = campaign(kills=12, seed=20, kills_a_run=6)
    print(record)
    check(record["kills"] >= 12, f"{record['kills']} kills")
    finish()


if __name__ == "__main__":
    main()
