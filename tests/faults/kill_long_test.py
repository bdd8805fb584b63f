#!/usr/bin/python3
"""Two hundred kills with a second starter beside each, recorded. As kill_long_test.py PROGRAM FILE.json [KILLS] the record of so many is
written there: docs/reliability.json holds that of 500."""
import json
import subprocess
import sys

from faults import check, finish, program
from kills import campaign


def main():
    kills = int(sys.argv[3]) if len(sys.argv) > 3 else 200
    record = campaign(kills=kills, seed=kills)
    record["version"] = subprocess.run([program, "--version"], capture_output=True, text=True).stdout.strip()
    print(json.dumps(record, indent=1))
    check(record["kills"] == kills, f"{record['kills']} kills")
    check(record["runs_with_the_bits_of_the_undisturbed_one"] == record["runs"], "every run ended with the bits of the undisturbed one")
    if len(sys.argv) > 2:
        with open(sys.argv[2], "w") as f:
            json.dump(record, f, indent=1)
    finish()


if __name__ == "__main__":
    main()
