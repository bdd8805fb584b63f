#!/usr/bin/python3
"""The quick validation suite, as a test: coarse experiments, their gates and their negative controls."""
import os
import sys
import tempfile


def main():
    with tempfile.TemporaryDirectory(prefix="kuzure-validation-") as work:
        # KUZURE_RESULTS, where it is set, collects the records of all tests; the coarse runs must not replace the full ones there.
        os.environ["KUZURE_RESULTS"] = work
        os.environ.pop("KUZURE_FIGURES", None)
        import validate

        status = validate.main(["--quick", "--known", sys.argv[1]])
    sys.exit(status)


if __name__ == "__main__":
    main()
