#!/usr/bin/env bash
# The threaded unit tests under the thread sanitizer. GCC's OpenMP library hides its barriers from the sanitizer, which then
# sees races everywhere; clang's libomp tells it through archer. So this needs clang, which jobs/install.sh does not install:
#   apt-get install clang libclang-rt-dev libomp-dev llvm
# tests/tsan.sh [TEST...]; without: those whose code runs on several threads.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source jobs/environment.sh
archer=$(ls /usr/lib/llvm-*/lib/libarcher.so 2>/dev/null | sort -V | tail -n 1)
command -v clang++ >/dev/null && [ -n "$archer" ] || { echo "clang, libomp or archer is missing: apt-get install clang libomp-dev llvm" >&2; exit 1; }
tests=("$@")
[ ${#tests[@]} != 0 ] || tests=(pass_test evolution_test)

# The check must be able to fail: a race planted in a loop is found, the same loop with a reduction is not blamed.
planted=$(mktemp -d)
trap 'rm -rf "$planted"' EXIT
cat >"$planted/race.cpp" <<'CPP'
int main()
{
    double sum = 0;
#ifdef CLEAN
#pragma omp parallel for reduction(+ : sum)
#else
#pragma omp parallel for
#endif
    for (int i = 0; i < 100000; ++i) sum += i;
    return sum < 0;
}
CPP
export OMP_NUM_THREADS=4 OMP_TOOL_LIBRARIES=$archer TSAN_OPTIONS="ignore_noninstrumented_modules=1 halt_on_error=1"
clang++ -g -O1 -fsanitize=thread -fopenmp "$planted/race.cpp" -o "$planted/race"
clang++ -g -O1 -fsanitize=thread -fopenmp -DCLEAN "$planted/race.cpp" -o "$planted/clean"
if "$planted/race" 2>/dev/null; then echo "self-check: the planted race was not found" >&2; exit 1; fi
"$planted/clean" || { echo "self-check: a clean loop is blamed" >&2; exit 1; }

jobs/build.sh tsan "${tests[@]}"
for test in "${tests[@]}"; do
    echo "== $test"
    "build/tsan/tests/$test" --gtest_brief=1
done
echo "no race in ${tests[*]}"
