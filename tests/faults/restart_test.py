#!/usr/bin/python3
"""A part of the restart matrix in which every number of ranks comes before and after; all of it: restart_long_test.py."""
from faults import finish
from matrix import matrix


def main():
    matrix([(1, 7), (7, 2), (2, 3), (3, 4), (4, 1)])
    finish()


if __name__ == "__main__":
    main()
