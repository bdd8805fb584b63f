#!/usr/bin/env bash
# Configure and build one preset of CMakePresets.json: jobs/build.sh PRESET [TARGET...]. Quiet unless it fails; the
# output is in build/PRESET.log. KUZURE_CMAKE: more options of cmake, such as -DKUZURE_FIRST_VARIANT=-3.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source jobs/environment.sh
preset=${1:?usage: jobs/build.sh PRESET [TARGET...]}
shift
log=build/$preset.log
mkdir -p build

# A build directory that was copied or moved with its sources cannot be used again.
cache=build/$preset/CMakeCache.txt
if [ -f "$cache" ] && ! grep -qxF "CMAKE_HOME_DIRECTORY:INTERNAL=$PWD" "$cache"; then rm -rf "build/$preset"; fi

# A compiler may take 1 GB: no more of them at once than memory carries.
memory=$(awk '/^MemAvailable/ {print int($2 / 1048576)}' /proc/meminfo)
jobs=$((memory < 1 ? 1 : memory < KUZURE_CORES ? memory : KUZURE_CORES))
read -ra options <<<"${KUZURE_CMAKE-}"
if command -v ccache >/dev/null; then
    options+=(-DCMAKE_CXX_COMPILER_LAUNCHER=ccache)
    export CCACHE_BASEDIR=$PWD CCACHE_NOHASHDIR=1 # clones and work trees share what one of them compiled
fi

started=$SECONDS
failed() {
    grep -m 3 -A 5 -E 'error:|CMake Error|undefined reference' "$log" >&2 || tail -n 20 "$log" >&2
    echo "jobs/build.sh: $1 failed; all of its output is in $PWD/$log" >&2
    echo "If packages are missing: jobs/install.sh. If the directory is spoilt: rm -rf $PWD/build/$preset" >&2
    exit 1
}
cmake --preset "$preset" "${options[@]}" >"$log" 2>&1 || failed "the configuration of preset $preset"
targets=()
[ $# = 0 ] || targets=(--target "$@")
cmake --build "build/$preset" -j "$jobs" "${targets[@]}" >>"$log" 2>&1 || failed "the build of preset $preset"
echo "built build/$preset in $((SECONDS - started)) s"
