#!/usr/bin/python3
"""Built by clang, kuzure passes its unit tests and gives the reference bits of tests/regression.
Run as clang_long_test.py PROGRAM; builds the preset clang. Needs jobs/install.sh builds; not run (77) without."""
import os

from builds import build, names, need_tools, reference_bits, suite, version
from harness import check, finish


def main():
    need_tools("clang++", "/usr/lib/llvm-14/lib/libomp.so")
    directory = build("clang", "kuzure", *names("unit"))
    kuzure = os.path.join(directory, "kuzure")
    check("Clang" in version([kuzure]), version([kuzure]))
    suite(directory, "tests/unit", "-L", "^unit$", "-E", "_replay$|_long_test$")
    reference_bits(kuzure)
    finish()


if __name__ == "__main__":
    main()
