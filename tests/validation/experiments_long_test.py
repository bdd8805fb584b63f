#!/usr/bin/python3
"""The full validation suite, as a test. Records go to $KUZURE_RESULTS (default results/validation), where finished runs are not repeated."""
import sys

import validate


def main():
    sys.exit(validate.main(["--known", sys.argv[1]]))


if __name__ == "__main__":
    main()
