#!/usr/bin/env bash
# The loops, built by Makefile.knl for Knights Landing without its own extensions, hold no instruction that it lacks; and
# where the processor has AVX-512 the whole program, built so, gives the physics of the one under test.
#     knl_objects_test.sh PROGRAM
set -euo pipefail
program=$(realpath "${1:?usage: knl_objects_test.sh PROGRAM}")
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
source jobs/environment.sh
check=(/usr/bin/python3 tests/layers/knl_instructions.py)
scratch=$(mktemp -d)
trap 'rm -rf "$scratch"' EXIT

# The checker must see what is wrong, each by itself, and must let pass what is right.
lacking=('vpmovm2q %k1, %zmm0' 'vandpd %zmm1, %zmm2, %zmm3' 'vpaddw %zmm1, %zmm2, %zmm3' 'vinsertf64x2 $1, %xmm1, %zmm2, %zmm3'
    'kmovb %k1, %eax' 'kmovd %k1, %eax' 'kmovq %k1, %rax' 'kaddw %k1, %k2, %k3' 'vaddpd %ymm17, %ymm1, %ymm2'
    'vaddpd %ymm1, %ymm1, %ymm2{%k1}' '{evex} vaddpd %xmm1, %xmm1, %xmm2' 'vmovdqu64 %xmm17, (%rax)' 'vpmullq %zmm1, %zmm2, %zmm3'
    'vextractf32x8 $1, %zmm1, %ymm2' 'vrsqrt28ps %zmm1, %zmm2' 'vpdpbusd %zmm1, %zmm2, %zmm3')
for instruction in "${lacking[@]}"; do
    printf 'f:\n vaddpd %%zmm1, %%zmm2, %%zmm3\n %s\n ret\n' "$instruction" | as -o "$scratch/bad.o" -
    status=0
    "${check[@]}" "$scratch/bad.o" >"$scratch/said" || status=$?
    if [ $status != 1 ] || ! grep -q ', 1 that Knights Landing lacks' "$scratch/said"; then
        echo "self-check: '$instruction' was not found (status $status)"
        exit 1
    fi
done
as -o "$scratch/good.o" - <<'S'
f: vfmadd231pd %zmm1, %zmm2, %zmm3
   vaddpd {rn-sae}, %zmm1, %zmm2, %zmm31
   vaddsd %xmm17, %xmm18, %xmm19
   vmulsd {rn-sae}, %xmm17, %xmm18, %xmm19
   vmovq %xmm17, (%rax)
   vmovsd %xmm17, %fs:8
   vcvtsi2sd %eax, %xmm17, %xmm18
   vcvtpd2ps %zmm1, %ymm17
   vgatherdpd (%rax, %ymm17, 8), %zmm1{%k1}
   vextractf64x4 $1, %zmm1, %ymm17
   vaddpd g(%rip), %zmm1, %zmm2
   vcmppd $1, %zmm1, %zmm2, %k1
   vpaddd %zmm1, %zmm2, %zmm3{%k1}{z}
   vrsqrt14pd %zmm1, %zmm2
   vpconflictq %zmm1, %zmm2
   kmovw %k1, %eax
   kunpckbw %k1, %k2, %k3
   vandpd %ymm1, %ymm2, %ymm3
   vpaddw %ymm1, %ymm2, %ymm3
   call f@plt
   .data
g: .quad 0
S
"${check[@]}" "$scratch/good.o" || { echo "self-check: an instruction that Knights Landing has was refused"; exit 1; }

cache=
if command -v ccache >/dev/null; then cache="ccache "; fi
build=build/knl-make-no-er
# Two pair models stand for all of them: the bare one of a dry collapse, and the one with every term of the pair loop.
objects=("$build/variant_1.o" "$build/variant_8.o")
shopt -s nullglob
for source in solver/{core,scene,physics,neighbours,kernels,effects}/*.cpp; do
    [ "$source" = solver/kernels/variant.cpp ] || objects+=("$build/${source%.cpp}.o")
done
make -s -f Makefile.knl NO_ER=1 KERNEL_CXX="${cache}g++" -j "$KUZURE_CORES" "${objects[@]}" >"$scratch/make" 2>&1 || {
    tail -n 20 "$scratch/make"
    echo "make -f Makefile.knl NO_ER=1 ${objects[*]} failed (GCC 11 to 14 is needed: GCC 15 has dropped -march=knl)"
    exit 1
}
# Where nothing of AVX-512 is found the check would be empty: the pair loops must hold plenty of it.
"${check[@]}" "${objects[@]}" | tee "$scratch/said"
used=$(sed -n 's/.* \([0-9]*\) different AVX-512 instructions.*/\1/p' "$scratch/said")
[ "$used" -gt 100 ] || { echo "only $used AVX-512 instructions: the loops were not built for it"; exit 1; }

if ! grep -qw avx512f /proc/cpuinfo; then
    echo "NOT RUN: this processor has no AVX-512, so the program built for Knights Landing was not run and compared."
    exit 0
fi
make -s -f Makefile.knl NO_ER=1 KERNEL_CXX="${cache}g++" MPICXX="${cache}mpicxx" -j "$KUZURE_CORES" >"$scratch/make" 2>&1 || {
    tail -n 20 "$scratch/make"
    exit 1
}
cat >"$scratch/column.toml" <<'T'
title = "small column"
dimensions = 3
[space]
spacing = 0.05
[time]
end = 0.05
step = 1.0e-4
[soil.sand]
density = 1850.0
young = 1.8e6
poisson = 0.3
friction_angle = 25.0
[[body]]
soil = "sand"
box = { low = [0.0, 0.0, 0.0], high = [0.4, 0.4, 0.4] }
[[wall]]
box = { low = [-0.5, -0.5, -0.2], high = [0.9, 0.9, 0.0] }
[effects]
gravity = [0.0, 0.0, -9.81]
viscosity = { alpha = 0.1, beta = 0.0 }
T
"$program" run "$scratch/column.toml" -o "$scratch/here" --quiet
"$build/kuzure" run "$scratch/column.toml" -o "$scratch/knl" --quiet
# The two differ in the last bits (other reciprocals), so sums of energies agree to rounding, not to the bit.
/usr/bin/python3 - "$scratch/here/summary.json" "$scratch/knl/summary.json" <<'PY'
import json, sys
here, knl = (json.load(open(path)) for path in sys.argv[1:])
for count in ("soil_particles", "wall_particles", "steps"):
    assert here[count] == knl[count], (count, here[count], knl[count])
assert abs(here["pairs"] - knl["pairs"]) <= 1e-6 * here["pairs"], (here["pairs"], knl["pairs"])
largest = max(abs(e) for e in here["energy"].values())
for kind, energy in here["energy"].items():
    assert kind == "residual" or abs(energy - knl["energy"][kind]) <= 1e-6 * largest, (kind, energy, knl["energy"][kind])
print("the program built for Knights Landing agrees over", here["steps"], "steps")
PY
