#!/usr/bin/env bash
# Install what kuzure needs (Debian 12 or later, Ubuntu 24.04 or later): as root, or with a sudo that asks no password.
#   jobs/install.sh          to build and run
#   jobs/install.sh tests    also what only the test suite needs
#   jobs/install.sh extras   also a browser for the report's test, ffmpeg for films and a font for Japanese titles; Ubuntu has Chromium as a
#                            snap only
#   jobs/install.sh paraview also ParaView and a display in memory, 1.1 GB, for the test of its macro
#   jobs/install.sh cluster  also what the tests on virtual nodes need: ctest -L cluster
#   jobs/install.sh builds   also other compilers, MPI libraries and architectures for tests/builds: clang, MPICH, a cross compiler and qemu
#                            for 64-bit Arm, and its libraries, unpacked into build/arm64 (570 MB); doxygen
# Does nothing, and needs no network, where everything is there.
set -euo pipefail

build=(g++ cmake ninja-build ccache git make pkg-config)
libraries=(libopenmpi-dev openmpi-bin libmetis-dev libhdf5-openmpi-dev libtomlplusplus-dev libcli11-dev libfmt-dev
    libpng-dev libpango1.0-dev fonts-dejavu-core nlohmann-json3-dev libgtest-dev libgmock-dev libbenchmark-dev
    libtiff-dev libgeotiff-dev libproj-dev libshp-dev libpugixml-dev libarchive-dev)
scripts=(python3 python3-h5py python3-numpy)
command -v gnuplot >/dev/null || scripts+=(gnuplot-nox) # its flavours exclude one another: any will do
tests=(black clang-format valgrind binutils dpkg-dev fakeroot python3-jsonschema gdal-bin
    python3-pip python3-setuptools python3-wheel python3-matplotlib python3-pandas)
extras=(ffmpeg fonts-ipafont-gothic)
command -v chromium >/dev/null || extras+=(chromium)
paraview=(paraview python3-paraview xvfb xauth libgl1-mesa-dri)
builds=(clang libclang-rt-dev libomp-dev mpich libmpich-dev libhdf5-mpich-dev g++-aarch64-linux-gnu qemu-user mmdebstrap doxygen)
arm64_libraries=libmpich-dev,libhdf5-mpich-dev,libmetis-dev,libfmt-dev,libtomlplusplus-dev,libcli11-dev,libpng-dev,nlohmann-json3-dev
arm64_libraries+=,libgtest-dev,libgmock-dev,libc6-dev,libstdc++-12-dev,libgomp1
cluster=(slurm-wlm munge iproute2 util-linux shellcheck)

packages=("${build[@]}" "${libraries[@]}" "${scripts[@]}")
case "${1-}" in
"") ;;
tests) packages+=("${tests[@]}") ;;
extras) packages+=("${extras[@]}") ;;
paraview) packages+=("${tests[@]}" "${paraview[@]}") ;;
cluster) packages+=("${tests[@]}" "${cluster[@]}") ;;
builds) packages+=("${tests[@]}" "${builds[@]}") ;;
*)
    echo "usage: jobs/install.sh [tests|extras|paraview|cluster|builds]" >&2
    exit 2
    ;;
esac

fail() {
    printf 'jobs/install.sh: %s\n' "$@" >&2
    exit 1
}

if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
    missing=()
    for tool in g++ cmake ninja mpirun; do
        command -v "$tool" >/dev/null || missing+=("$tool")
    done
    /usr/bin/python3 -c 'import h5py, numpy' 2>/dev/null || missing+=("python3-h5py+numpy")
    [ ${#missing[@]} = 0 ] && exit 0 # the libraries are CMake's to find and to name
    fail "this is not a Debian or Ubuntu system, so the packages have to be installed by hand." \
        "missing here: ${missing[*]}" \
        "needed: a C++20 compiler (g++ 11 to 14), cmake 3.22+, ninja, git, make; an MPI; METIS 5; parallel HDF5 1.10+;" \
        "  toml++ 3.3+, CLI11 2, fmt 8+, libpng, Pango with Cairo (for pictures), nlohmann-json 3; libtiff 4, libgeotiff 1.7, PROJ 7+, shapelib," \
        "  pugixml and libarchive (for real ground); GoogleTest 1.12+, Google Benchmark; python3 with h5py and" \
        "  numpy; gnuplot; for the tests black 23, clang-format 14, valgrind, binutils, GDAL's tools, python3 with jsonschema, pip, setuptools," \
        "  wheel, matplotlib and pandas." \
        "Fedora: dnf install gcc-c++ cmake ninja-build ccache git make openmpi-devel metis-devel hdf5-openmpi-devel tomlplusplus-devel" \
        "  cli11-devel fmt-devel libpng-devel pango-devel dejavu-sans-fonts json-devel gtest-devel gmock-devel google-benchmark-devel python3-h5py python3-jsonschema gnuplot" \
        "  libtiff-devel libgeotiff-devel proj-devel shapelib-devel pugixml-devel libarchive-devel gdal python3-pip python3-setuptools python3-wheel python3-matplotlib python3-pandas" \
        "Debian names: ${packages[*]}"
fi

# Exit status 1 only says that dpkg has never heard of some of them: those are not in its answer.
installed=" $(dpkg-query -W -f '${db:Status-Abbrev}${Package} ' "${packages[@]}" 2>/dev/null || true)"
missing=()
for package in "${packages[@]}"; do
    [[ $installed == *" ii $package "* || $installed == *" hi $package "* ]] || missing+=("$package")
done
arm64=$(dirname "${BASH_SOURCE[0]}")/../build/arm64
[ "${1-}" != builds ] || [ -e "$arm64/usr/lib/aarch64-linux-gnu/libmpich.so" ] || need_arm64=yes
[ ${#missing[@]} != 0 ] || [ -n "${need_arm64-}" ] || exit 0

as_root=()
if [ "$(id -u)" != 0 ]; then
    by_hand="run: sudo apt-get update && sudo apt-get install --no-install-recommends ${missing[*]}"
    command -v sudo >/dev/null || fail "packages are missing, and this is neither root nor is there a sudo." \
        "As root, ${by_hand//sudo /}"
    sudo -n true 2>/dev/null || fail "packages are missing, and sudo wants a password here." "Once, $by_hand"
    as_root=(sudo -n)
fi

log=$(mktemp "${TMPDIR:-/tmp}/kuzure-install.XXXXXX")
started=$SECONDS
apt() { # an apt-get that waits for other installers, asks nothing, and keeps its talk to the log
    "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive NEEDRESTART_MODE=a apt-get -q -y -o DPkg::Lock::Timeout=600 \
        -o Acquire::Retries=3 "$@" >>"$log" 2>&1 </dev/null
}
[ ${#missing[@]} = 0 ] || echo "installing ${#missing[@]} packages (a minute or more, as the network is; what happens: tail $log): ${missing[*]}"
updated=yes
[ ${#missing[@]} = 0 ] || apt update || updated=no
if [ ${#missing[@]} != 0 ] && ! apt install --no-install-recommends "${missing[@]}"; then
    tail -n 15 "$log" >&2
    if [ $updated = no ]; then
        fail "the package lists could not be fetched: is there a network, or a proxy to set in /etc/apt/apt.conf?" \
            "The whole log: $log"
    fi
    fail "apt-get could not install: ${missing[*]}" "Debian before 12 and Ubuntu before 24.04 do not have them all." \
        "If a package was interrupted before, run: dpkg --configure -a. The whole log: $log"
fi
if [ -n "${need_arm64-}" ]; then
    # Unpacked, not installed: no architecture is added to this system.
    mkdir -p "$(dirname "$arm64")"
    rm -rf "$arm64"
    mmdebstrap --architectures=arm64 --variant=extract --include=$arm64_libraries bookworm "$arm64" http://deb.debian.org/debian >>"$log" 2>&1 ||
        fail "the libraries for 64-bit Arm could not be fetched. The whole log: $log"
fi
rm -f "$log"
echo "installed in $((SECONDS - started)) s"
