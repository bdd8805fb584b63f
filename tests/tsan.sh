#!/usr/bin/env bash
# What runs on several threads under the thread sanitizer: unit tests, and the program itself on four threads, where sorting, lists,
# pass, guard and energies run as they do for users. GCC's OpenMP library hides its barriers from the sanitizer, which then
# sees races everywhere; clang's libomp tells it through archer. So this needs clang, which jobs/install.sh does not install:
#   apt-get install clang libclang-rt-dev libomp-dev llvm
# tests/tsan.sh [UNIT-TEST...]; without: pass_test.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source jobs/environment.sh
archer=$(ls /usr/lib/llvm-*/lib/libarcher.so 2>/dev/null | sort -V | tail -n 1)
command -v clang++ >/dev/null && [ -n "$archer" ] || { echo "clang, libomp or archer is missing: apt-get install clang libomp-dev llvm" >&2; exit 1; }
tests=("$@")
[ ${#tests[@]} != 0 ] || tests=(pass_test)

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

jobs/build.sh tsan kuzure "${tests[@]}"
# So large that the sort takes several threads (above 20,000 particles), so short that every kind of step comes once.
scene=jobs/scenes/hirata_52.toml
for more in time.end=0.0012 accuracy.precision=mixed effects.stress_diffusion=auto; do
    echo "== kuzure run $scene --set $more"
    build/tsan/kuzure run "$scene" -o "$planted/out" --force --quiet --threads 4 --set time.end=0.0006 --set output.history=0.0001 --set "$more"
done
for test in "${tests[@]}"; do
    echo "== $test"
    "build/tsan/tests/$test" --gtest_brief=1
done
echo "no race in kuzure and ${tests[*]}"
