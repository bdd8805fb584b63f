#!/usr/bin/python3
"""The full validation suite, as a test. Records go to $KUZURE_RESULTS (default results/validation), where finished runs are not repeated."""
import sys

import validate

sys.exit(validate.main(["--known", sys.argv[1]]))
