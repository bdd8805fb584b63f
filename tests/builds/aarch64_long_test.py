#!/usr/bin/python3
"""Cross-compiled for 64-bit Arm, with NEON and with SVE of 512 bits, kuzure passes unit tests under qemu and gives the reference bits.
Run as aarch64_long_test.py PROGRAM; builds the presets aarch64 and aarch64-sve512. Needs jobs/install.sh builds; not run (77) without."""
import os
import subprocess

from builds import build, names, need_tools, state, suite, version
from harness import check, finish, program, root, scratch

ARM64 = os.path.join(root, "build/arm64")
# With every other length of its registers the program for 512 bits must not be started: the launcher knows.
QEMU = ["qemu-aarch64", "-cpu", "max,sve512=on,sve-default-vector-length=64", "-L", ARM64]
# What these want is not there: Cairo and GDAL's kin (built without), the start time of processes, which qemu makes up, a /tmp that is not
# the sysroot's, a clock whose seconds are not those of an emulator, and for the last one less than an emulator's hour.
WITHOUT = {"picture_test", "raster_test", "owner_test", "phases_test", "io_test", "staggered_by_the_book_test"}


def launcher_of(work):
    """The launcher of a package: with programs for NEON and for SVE beside it, which does it start?"""
    done = subprocess.run(
        ["aarch64-linux-gnu-g++", "-std=c++20", "-O1", "-static", "-o", os.path.join(work, "launcher")]
        + [os.path.join(root, "solver/app/launcher/launcher.cpp")],
        capture_output=True,
        text=True,
    )
    check(done.returncode == 0, f"the launcher compiles for Arm {done.stderr[-500:]}")
    for bits, first in ((512, "sve-512"), (256, "sve-256"), (128, "aarch64")):
        cpu = ["-cpu", f"max,sve-default-vector-length={bits // 8}"]
        calls = subprocess.run(["qemu-aarch64", *cpu, "-strace", os.path.join(work, "launcher")], capture_output=True, text=True)
        starts = [line for line in calls.stderr.splitlines() if "execve" in line]
        check(starts and f"/{first}/kuzure" in starts[0], f"registers of {bits} bits: {starts[:1]}")


def main():
    need_tools("aarch64-linux-gnu-g++", "qemu-aarch64", "mpiexec.mpich", os.path.join(ARM64, "usr/lib/aarch64-linux-gnu/libmpich.so"))
    work = scratch("aarch64")
    launcher_of(work)
    here = {s: state([program], os.path.join(root, f"tests/regression/{s}.toml"), os.path.join(work, s)) for s in ("cohesive_2d", "dry_3d")}
    for preset, tests in (("aarch64", [n for n in names("unit", "mpi") if n not in WITHOUT]), ("aarch64-sve512", ["pass_test"])):
        directory = build(preset, "kuzure", *tests)
        command = [*QEMU, os.path.join(directory, "kuzure")]
        print(version(command))
        chosen = "|".join(tests)
        suite(directory, f"{preset}: {len(tests)} programs", "-R", rf"^unit\.({chosen})$|^mpi\.({chosen})\.[12]$")
        for scene, expected in here.items():
            got = state(command, os.path.join(root, f"tests/regression/{scene}.toml"), os.path.join(work, preset + scene))
            check(got["state_hash"] == expected["state_hash"], f"{preset}, {scene}: {got['state_hash']}, here {expected['state_hash']}")
    finish()


if __name__ == "__main__":
    main()
