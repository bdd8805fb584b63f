#!/usr/bin/python3
"""A part of the restart matrix in which every number of ranks comes before and after; all of it: restart_long_test.py."""
from faults import end
from matrix import matrix

matrix([(1, 7), (7, 2), (2, 3), (3, 4), (4, 1)])
end()
