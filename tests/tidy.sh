#!/usr/bin/env bash
# clang-tidy over the program's own sources by the rules of .clang-tidy: tests/tidy.sh [FILE...]. Needs clang-tidy
# 14 or later, which jobs/install.sh does not install (apt-get install clang-tidy). Ends with 1 if anything is found.
set -uo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit
command -v clang-tidy >/dev/null || { echo "clang-tidy is missing: apt-get install clang-tidy" >&2; exit 1; }
cmake --preset release -B build/tidy -DKUZURE_UNITY=OFF >/dev/null || exit # each source with a command of its own
files=("$@")
# variant.cpp is one source for many objects: the lowest stands for all.
[ ${#files[@]} != 0 ] || mapfile -t files < <(git ls-files 'solver/*.cpp' 'decomposition/*.cpp' 'io/*.cpp' 'perf/*.cpp' | grep -v '^perf/bench/')
bad=0
for file in "${files[@]}"; do
    # GCC's own warning options mean nothing to clang.
    if ! clang-tidy --quiet -p build/tidy --extra-arg=-Wno-unknown-warning-option "$file" 2>/dev/null; then
        echo "$file: clang-tidy found something"
        bad=1
    fi
done
[ $bad = 0 ] && echo "${#files[@]} files pass clang-tidy"
exit $bad
