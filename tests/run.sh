#!/usr/bin/env bash
# The whole test suite from a fresh machine: install, build, test, then the readers' replays, the unit tests and the two-rank MPI tests
# again under the sanitizers (without the tests of solver/app, which takes two fifths of the compiler's time). Slower studies:
# ctest --test-dir build/release -L long. Ends with "N passed, N failed".
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit
source jobs/environment.sh
if [ $# != 0 ]; then
    echo "tests/run.sh takes no arguments; single tests: ctest --test-dir build/release -R NAME" >&2
    exit 2
fi

minutes=25 # what the whole may take; the sanitizers are left out, and that is said, when they would not fit
passed=0
failed=0
parts=()
not_run=() # tests of what this machine has not; each says what it is and how to get it
asan_note=
mkdir -p build
exec 9>build/.test-lock
flock -n 9 || { echo "another tests/run.sh is running in $PWD: waiting for it"; flock 9; }

part_started=$SECONDS
part_ends() { # NAME: remember what it took
    parts+=("$(printf '%7d s  %s' $((SECONDS - part_started)) "$1")")
    part_started=$SECONDS
}
finish() {
    echo
    echo "where the time went:"
    printf '%s\n' "${parts[@]}"
    printf '%7d s  in all\n' $SECONDS
    [ ${#not_run[@]} = 0 ] || printf 'not run, something is missing here: %s\n' "${not_run[@]}"
    [ -z "$asan_note" ] || echo "$asan_note"
    echo "$passed passed, $failed failed"
    [ $failed = 0 ] && [ $passed -gt 0 ]
    exit
}
or_stop() { # a part without which nothing else makes sense
    failed=$((failed + 1))
    part_ends "$1 (failed)"
    finish
}
# suite NAME DIRECTORY CTEST-ARGUMENTS...: run tests of a build directory and count them.
suite() {
    local name=$1 directory=$2 result=build/tests-$1.xml
    shift 2
    echo
    echo "== $name"
    rm -f "$result"
    ctest --test-dir "$directory" --output-on-failure --no-tests=ignore --output-junit "$PWD/$result" "$@" </dev/null
    local status=$? counts
    if counts=$(/usr/bin/python3 tests/count.py "$result"); then
        read -r good bad without <<<"$counts"
        [ -z "$without" ] || not_run+=("$without")
        [ "$status" = 0 ] || [ "$bad" != 0 ] || bad=1
    else
        good=0 bad=1 # ctest itself broke down
    fi
    passed=$((passed + good))
    failed=$((failed + bad))
    part_ends "$name: $good passed, $bad failed"
}

jobs/install.sh tests || or_stop install
part_ends install
echo "building (ten to fifteen minutes on two cores, once; without change seconds)"
jobs/build.sh release || or_stop build
part_ends "build, release"

slow='^(long|cluster)$'
suite tests build/release -LE '^(long|cluster|perf)$' -j "$KUZURE_CORES"
suite perf build/release -L '^perf$' -LE "$slow" # alone on the machine: they measure

asan_note="The sanitizers were not run: less than 6 of $minutes minutes were left. Run again: the builds are done then."
left=$((minutes * 60 - SECONDS))
if [ $left -gt 360 ]; then
    echo
    asan_note=
    # The compiler cache keeps what a build that was cut short has done.
    # staggered_by_the_book_test takes six minutes so: pass_test and by_the_book_test run the same loops.
    mapfile -t checked < <(grep -LE '#include "solver/app/' tests/{unit,mpi}/*_test.cpp | xargs basename -a -s .cpp | grep -vx staggered_by_the_book_test)
    for fuzzer in tests/fuzz/*_fuzz.cpp; do checked+=("$(basename "$fuzzer" _fuzz.cpp)_replay"); done
    timeout $((left - 150)) jobs/build.sh asan "${checked[@]}"
    status=$?
    if [ $status = 124 ]; then
        asan_note="The sanitizers were not run: their build did not fit into $minutes minutes. Run again: it goes on where it stopped."
    elif [ $status != 0 ]; then
        failed=$((failed + 1))
    fi
    part_ends "build, sanitizers"
    if [ $status = 0 ]; then
        # Slow unwinding, or the suppressions do not match: Open MPI's plugins are unloaded before the leaks are named.
        export ASAN_OPTIONS=detect_leaks=1:fast_unwind_on_malloc=0
        export LSAN_OPTIONS=suppressions=$PWD/tests/lsan.supp:print_suppressions=0
        export UBSAN_OPTIONS=print_stacktrace=1
        names=$(IFS='|' && echo "${checked[*]}")
        suite sanitizers build/asan -R "^(unit\.($names)|mpi\.($names)\.2)\$" -LE "$slow" -j "$KUZURE_CORES"
    fi
fi
finish
