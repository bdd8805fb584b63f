"""kuzure for Spack: spack repo add jobs/spack && spack install kuzure. docs/running.md says what was tried."""
from pathlib import Path

from spack.package import *


class Kuzure(CMakePackage):
    """Collapse of soil masses by smoothed particle hydrodynamics: elasto-plastic Drucker-Prager soil on MPI ranks with OpenMP threads, the
    same bits for any number of them."""

    # There is no public address yet: the clone that this file is in.
    git = Path(__file__).resolve().parents[4].as_uri()

    license("MIT")

    version("main", branch="main")

    variant("pictures", default=True, description="draw pictures, by Cairo and Pango")
    variant("terrain", default=True, description="read and write maps")

    depends_on("c", type="build")
    depends_on("cxx", type="build")
    depends_on("cmake@3.22:", type="build")
    depends_on("ninja", type="build")
    depends_on("pkgconfig", type="build")
    depends_on("mpi@3:")
    depends_on("hdf5@1.10: +mpi")
    depends_on("metis@5:")
    depends_on("fmt@8:")
    depends_on("libpng")
    depends_on("tomlplusplus@3.3:", type="build")
    depends_on("cli11@2:", type="build")
    depends_on("nlohmann-json@3:", type="build")
    depends_on("pango", when="+pictures")
    with when("+terrain"):
        depends_on("libtiff@4:")
        depends_on("libgeotiff@1.7:")
        depends_on("proj@7:")
        depends_on("shapelib")
        depends_on("pugixml")
        depends_on("libarchive")

    conflicts("%gcc@:10", msg="C++20 is needed: g++ 11 or later")
    # Theirs is a model of one processor that GCC 15 dropped; Makefile.knl builds for it.
    conflicts("target=mic_knl %gcc@15:")

    generator("ninja")

    def cmake_args(self):
        args = [
            # Spack's compiler wrapper says -march itself.
            self.define("KUZURE_ARCH", ""),
            self.define("KUZURE_TESTS", False),
            self.define("KUZURE_BENCHMARKS", False),
            self.define_from_variant("KUZURE_PICTURES", "pictures"),
            self.define_from_variant("KUZURE_TERRAIN", "terrain"),
        ]
        if "avx512f" in self.spec.target:
            args.append(self.define("CMAKE_CXX_FLAGS", "-mprefer-vector-width=512"))
        return args
