#!/usr/bin/env bash
# The studies of docs/accuracy.md: jobs/studies/run.sh [NAME...] (default: all four, about 16 core-minutes, half of them the finest runs
# of the one-pass scheme). Finished points are not run again. Results are in results/accuracy; jobs/studies/publish.py results/accuracy
# writes the page, its figures and the table behind `kuzure check --accuracy` from them.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source jobs/environment.sh
program=${KUZURE:-build/release/kuzure}
if [ ! -x "$program" ]; then
    echo "jobs/studies/run.sh: no program $program: build it with jobs/build.sh release kuzure, or name another in KUZURE" >&2
    exit 2
fi
[ $# -gt 0 ] || set -- k0_column aluminium_bars cylinder hirata
for name; do "$program" study "jobs/studies/$name.sweep.toml" -o "results/accuracy/$name"; done
