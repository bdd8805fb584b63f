#!/usr/bin/env bash
# The first five minutes: install what is missing, build, run one scene on all cores, say what to look at.
set -euo pipefail
from=$PWD
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source jobs/environment.sh
scene=jobs/scenes/quickstart.toml
results=results/quickstart
kuzure=build/release/kuzure
started=$SECONDS

if [ $# != 0 ]; then
    echo "jobs/quickstart.sh takes no arguments; other scenes: $kuzure run SCENE.toml" >&2
    exit 2
fi
jobs/install.sh
[ -x $kuzure ] || echo "building, once: some minutes (how far it is: tail -n 1 $PWD/build/release.log)"
jobs/build.sh release kuzure

force=()
[ ! -e $results ] || force=(--force) # keeps what an earlier run left, under another name
run=0
$kuzure run $scene -o $results --threads "$KUZURE_CORES" "${force[@]}" || run=$?
if [ $run != 0 ]; then
    echo "jobs/quickstart.sh: the run ended with exit code $run; the message above says why." >&2
    echo "2: scene or command line, 3: the numbers failed, 4: a file could not be written (space, permission?), 5: stopped" >&2
    exit $run
fi
if ! $kuzure report $results >/dev/null; then echo "(no report: the message above says why; the results are complete)" >&2; fi

shopt -s nullglob
pictures=("$results"/picture_[0-9]*.png) # in order of time
named() { realpath -s --relative-to="$from" "$1"; }
cat <<EOF

Done in $((SECONDS - started)) s. In $(named $results):
EOF
[ ${#pictures[@]} = 0 ] || printf '  picture    %s\n' "$(named "${pictures[-1]}")"
[ ! -e $results/report.html ] || printf '  report     %s\n' "$(named $results/report.html)"
cat <<EOF
  ParaView   $(named $results/snapshots/state.hdf.series)
Go on:
  $(named $kuzure) check $(named $scene)     what will be simulated and why, counts, time step, predicted minutes
  $(named $kuzure) run $(named $scene) -o DIR --set space.spacing=...     the same scene, finer
  $(named jobs/scenes)     more scenes; mpirun -n RANKS before kuzure runs them on several ranks
  $(named tests/run.sh)     the whole test suite
EOF
