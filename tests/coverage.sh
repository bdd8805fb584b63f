#!/usr/bin/env bash
# The share of the program's lines that the normal suite's tests reach, by gcovr (apt-get install gcovr; jobs/install.sh does
# not install it). tests/coverage.sh [CTEST-ARGUMENTS...]; without: everything but the long, cluster and perf tests, and those that
# step whole simulations to compare numbers (validation, stability, regression), which would take hours.
# The list of files is in build/coverage/coverage.txt.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source jobs/environment.sh
command -v gcovr >/dev/null || { echo "gcovr is missing: apt-get install gcovr" >&2; exit 1; }
jobs/build.sh coverage
find build/coverage -name '*.gcda' -delete
arguments=("$@")
[ ${#arguments[@]} != 0 ] || arguments=(-LE '^(long|cluster|perf|validation|stability|regression)$')
# A test that fails here has still reached its lines.
ctest --test-dir build/coverage -j "$KUZURE_CORES" "${arguments[@]}" </dev/null || echo "some tests failed: the figure is theirs too"
gcovr --root . --filter '(solver|decomposition|io|perf)/' --exclude 'perf/bench/' --exclude-throw-branches --txt build/coverage/coverage.txt \
    --print-summary build/coverage
