#!/usr/bin/env bash
# Build the Debian package: the program for x86-64, AVX2 (x86-64-v3) and AVX-512 (x86-64-v4), a launcher that starts the best
# one, data, documents, completions, manual page. Ends with the path of the .deb, looked through.
#   jobs/package.sh          the package; about half an hour on two quiet cores the first time
#   jobs/package.sh --try    tries the packaging alone: this machine's own program stands for all three; not to be given away
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
out=build/package
case "${1-}" in
"") ;;
--try)
    export KUZURE_CMAKE=-DKUZURE_ARCH=native
    out=build/package-try
    ;;
*)
    echo "usage: jobs/package.sh [--try]" >&2
    exit 2
    ;;
esac
fail() {
    echo "jobs/package.sh: $1" >&2
    exit 1
}
for tool in cpack dpkg-shlibdeps fakeroot; do
    command -v $tool >/dev/null || fail "$tool is missing; jobs/install.sh tests installs it"
done

isas=(x86-64 x86-64-v3 x86-64-v4)
base=$PWD/build/package-x86-64
parts="$base;kuzure;launcher;/;$base;kuzure;data;/"
for isa in "${isas[@]}"; do
    targets=(kuzure)
    [ "$isa" != x86-64 ] || targets+=(kuzure_launcher)
    jobs/build.sh "package-$isa" "${targets[@]}"
    parts+=";$PWD/build/package-$isa;kuzure;program;/"
done

rm -rf "$out"
mkdir -p "$out"
fakeroot cpack -G DEB --config "$base/CPackConfig.cmake" -B "$PWD/$out" -D CPACK_INSTALL_CMAKE_PROJECTS="$parts" \
    >build/package.log 2>&1 || {
    tail -n 20 build/package.log >&2
    fail "cpack failed; all of its output is in $PWD/build/package.log"
}
deb=$(ls "$out"/*.deb)
contents=$(dpkg -c "$deb")
for file in bin/kuzure share/kuzure/machines/slurm.toml share/kuzure/scenes/bank.toml lib/python3/dist-packages/kuzure/results.py share/man/man1/kuzure.1.gz share/doc/kuzure/changelog.gz share/bash-completion/completions/kuzure \
    "${isas[@]/%//kuzure}"; do
    grep -qE " \./usr/(lib/kuzure/)?$file( |$)" <<<"$contents" || fail "$deb has no $file; see $PWD/build/package.log"
done
if command -v lintian >/dev/null; then
    lintian --fail-on error,warning "$deb" >build/lintian.log 2>&1 || {
        cat build/lintian.log >&2
        fail "lintian finds fault with $deb; what is not meant to be mended is in the overrides of cmake/Install.cmake"
    }
fi
dpkg -f "$deb" Package Version Architecture Installed-Size Depends Suggests
echo "made $deb ($(du -h "$deb" | cut -f1)); to install it: apt-get install ./$deb"
