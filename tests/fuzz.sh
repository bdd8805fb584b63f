#!/usr/bin/env bash
# Fuzzing of the readers, tests/fuzz/NAME_fuzz.cpp, with libFuzzer, ASan and UBSan (docs/verification.md). Needs clang, which
# jobs/install.sh does not install: apt-get install clang libclang-rt-dev
#   tests/fuzz.sh NAME EXECUTIONS   so many more (scene, checkpoint ...); corpus and logs in build/fuzz/, which grow from run to run
#   tests/fuzz.sh count             executions of all runs so far, by their logs; those that go on count too
# A finding ends the run with 1 and lies in build/fuzz/findings; mend it and keep it as a seed in tests/fuzz/corpus.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
logs=build/fuzz/logs
mapfile -t all < <(basename -a -s _fuzz.cpp tests/fuzz/*_fuzz.cpp)
executions() { # by a log: what it says in the end, or had said when it was cut short
    local n
    n=$(grep -aoE '^#[0-9]+|^stat::number_of_executed_units: +[0-9]+' "$1" | tail -n 1 | grep -oE '[0-9]+$')
    echo "${n:-0}"
}
case ${1-} in
count)
    for what in "${all[@]}"; do
        total=0
        for log in "$logs/$what".*; do
            [ -f "$log" ] || continue
            total=$((total + $(executions "$log")))
        done
        echo "$what: $total executions, $(find "$logs" -name "$what.*" 2>/dev/null | wc -l) runs," \
            "$(grep -aoh 'cov: [0-9]*' "$logs/$what".* 2>/dev/null | sort -k2n | tail -n 1 | tr -dc 0-9) edges," \
            "$(find build/fuzz/findings -name "$what-*" 2>/dev/null | wc -l) findings"
    done
    exit
    ;;
scene) options=(-max_len=1600) ;;
checkpoint) options=(-max_len=12000) ;;
*) options=(-max_len=4000) ;;
esac
if [ ! -f "tests/fuzz/${1-}_fuzz.cpp" ]; then
    sed -n '2,7s/^# \{0,1\}//p' "$0" >&2
    exit 2
fi
what=$1
[ ! -f "tests/fuzz/$what.dict" ] || options+=("-dict=tests/fuzz/$what.dict")
runs=${2:?how many executions}
command -v clang++ >/dev/null || { echo "clang is missing: apt-get install clang libclang-rt-dev" >&2; exit 1; }
mkdir -p build
flock build/.fuzz-lock jobs/build.sh fuzz "${what}_fuzz" # several may be started at once
mkdir -p build/fuzz/findings "$logs"
# Goes on from the corpus that earlier runs have grown.
grown=tests/fuzz/grown/$what.tar.xz
if [ ! -d build/fuzz/corpus/$what ] && [ -f "$grown" ]; then mkdir -p build/fuzz/corpus && tar -C build/fuzz/corpus -xJf "$grown"; fi
mkdir -p build/fuzz/corpus/$what
# What is freed is kept from use for 8 MB, more than an input takes; of the stack at each allocation one frame is kept: findings
# are looked at again with all of them.
export ASAN_OPTIONS=detect_leaks=0:quarantine_size_mb=8:malloc_context_size=1:symbolize=0
fuzzer=build/fuzz/tests/${what}_fuzz
while [ "$runs" -gt 0 ]; do
    log=$logs/$what.$(date +%s)
    echo "$runs to go; log in $log"
    status=0
    $fuzzer -runs="$runs" -timeout=10 -rss_limit_mb=1500 -print_final_stats=1 "${options[@]}" \
        -artifact_prefix=build/fuzz/findings/$what- build/fuzz/corpus/$what tests/fuzz/corpus/$what >"$log" 2>&1 || status=$?
    runs=$((runs - $(executions "$log")))
    # The fuzzer's clock goes on while the machine is busy with others or the run is halted: what takes its time alone is a finding.
    for finding in build/fuzz/findings/$what-{timeout,slow-unit}-*; do
        [ -f "$finding" ] || continue
        ASAN_OPTIONS=detect_leaks=0 timeout 60 $fuzzer -runs=1 -timeout=10 -rss_limit_mb=1500 "$finding" >>"$log" 2>&1 || continue
        rm "$finding"
        [ $status != 70 ] || status=0
    done
    if [ $status != 0 ] || [ -n "$(find build/fuzz/findings -name "$what-*")" ]; then
        tail -n 40 "$log" >&2
        echo "tests/fuzz.sh: a finding; with its stack: build/fuzz/tests/${what}_fuzz build/fuzz/findings/$what-..." >&2
        exit 1
    fi
done
tail -n 8 "$log"
