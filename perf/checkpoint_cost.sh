#!/usr/bin/env bash
# What a checkpoint costs a million particles, raw and packed, against the disk's own speed: perf/checkpoint_cost.sh [DIRECTORY
# [MILLIONS [ROUNDS]]]. The state is that of the 52^3 collapse after 0.05 s; DIRECTORY (build/checkpoint_cost) is on the disk in question.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source jobs/environment.sh
directory=${1:-build/checkpoint_cost}
jobs/build.sh release kuzure bench_checkpoint
state=$directory/state
[ -f "$state/checkpoint.h5" ] || build/release/kuzure run jobs/scenes/hirata_52.toml --quiet --force -o "$state" --set time.end=0.05
build/release/bench_checkpoint "$state/checkpoint.h5" "$directory/files" "${@:2}"
