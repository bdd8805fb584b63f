#!/usr/bin/python3
"""Built with MPICH, kuzure passes the tests of the ranks and gives the bits that it gives with Open MPI, on one rank and on two.
Run as mpich_long_test.py PROGRAM; builds the preset mpich. Needs jobs/install.sh builds; not run (77) without."""
import os

from builds import build, names, need_tools, same_bits, suite, version
from harness import check, finish, root, scratch


def main():
    need_tools("mpicxx.mpich", "mpiexec.mpich", "/usr/bin/h5pcc.mpich")
    directory = build("mpich", "kuzure", *names("mpi"))
    kuzure = os.path.join(directory, "kuzure")
    check("MPICH" in version([kuzure]), version([kuzure]))
    suite(directory, "tests/mpi on one rank and on two", "-R", r"^mpi\..*\.[12]$")
    ranks = lambda n: ["mpiexec.mpich", "-n", str(n), kuzure]
    commands = {"MPICH, no launcher": [kuzure], "MPICH, one rank": ranks(1), "MPICH, two ranks": ranks(2)}
    work = scratch("mpich")
    same_bits(commands, os.path.join(root, "tests/regression/dry_3d.toml"), work)
    same_bits(commands, os.path.join(root, "jobs/scenes/quickstart.toml"), work, "time.end=0.1")
    finish()


if __name__ == "__main__":
    main()
