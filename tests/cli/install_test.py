#!/usr/bin/python3
"""An installed kuzure works from its place; find_package(kuzure) gives the solver library without MPI and HDF5, and whole runs.
Run as install_test.py PROGRAM; uses the libraries of PROGRAM's build directory and builds nothing there."""
import json
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
from harness import check, finish, need, program, root

PROGRAM = Path(program)
BUILD = PROGRAM.parent

CMAKE = """cmake_minimum_required(VERSION 3.22)
project(consumer CXX)
find_package(kuzure 0.1 REQUIRED)
add_executable(consumer main.cpp)
target_link_libraries(consumer PRIVATE kuzure::solver)
add_executable(scene_only scene.cpp)
target_link_libraries(scene_only PRIVATE kuzure::scene)
"""
# A stress far outside the cone comes back onto it; a model of the pair pass is chosen and named.
SOLVER = """#include <kuzure/solver/kernels/pair_model.hpp>
#include <kuzure/solver/physics/drucker_prager.hpp>
#include <kuzure/solver/scene/scene.hpp>
#include <cstdio>
int main()
{
    kuzure::Scene s;
    s.space.spacing = 0.1;
    s.soils.push_back({.name = "sand", .density = 1850, .young = 1.8e6, .poisson = 0.3, .friction_angle = 0.4363});
    const auto law = kuzure::Elastoplastic<double>::from(kuzure::Material::from(s.soils[0]));
    const kuzure::Stress trial{-3e3, -1e3, -9e3, 2e3, 0, 5e2};
    const auto back = kuzure::return_to_cone(trial, law);
    const auto model = kuzure::choose_model(s, kuzure::Arithmetic::Simd);
    const double out = kuzure::yield_function(trial, law), on = kuzure::yield_function(back.sigma, law);
    std::printf("%s outside %g, on the cone %g, work %g\\n", model->name().c_str(), out, on, back.plastic_work);
    return out > 100 && on < 1e-9 && on > -1e-9 && back.plastic_work > 0 && model->cluster_width() > 0 ? 0 : 1;
}
"""
SCENE = """#include <kuzure/solver/scene/fill.hpp>
#include <cstdio>
int main()
{
    const kuzure::scene::Lattice cube(kuzure::scene::Box{{0, 0, 0}, {1, 1, 1}}, 0.25, 3);
    std::printf("%lld\\n", (long long)(cube.size()));
    return cube.size() == 64 ? 0 : 1;
}
"""


def run(*command, cwd=None, expected=0, environment={}):
    environment = {**os.environ, **environment, "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    done = subprocess.run([str(c) for c in command], cwd=cwd, capture_output=True, text=True, timeout=600, env=environment)
    need(done.returncode == expected, f"{' '.join(map(str, command))}: exit {done.returncode}\n{done.stdout[-2000:]}{done.stderr[-2000:]}")
    return done.stdout


def of_page(language, words):
    """The block of docs/cpp.md in this language that holds these words."""
    text = (Path(root) / "docs/cpp.md").read_text()
    return next(block for block in re.findall(rf"^```{language}\n(.*?)^```", text, re.M | re.S) if words in block)


def try_simulation(work, prefix, program, flags):
    """The run in ten lines of docs/cpp.md, against an installed kuzure: the hash of the program, on one rank and on two."""
    source = work / "simulation"
    source.mkdir()
    (source / "CMakeLists.txt").write_text(of_page("cmake", "COMPONENTS simulation"))
    (source / "main.cpp").write_text(of_page("cpp", "kuzure/simulation.hpp"))
    run("cmake", "-S", source, "-B", source / "build", f"-DCMAKE_PREFIX_PATH={prefix}", *flags)
    run("cmake", "--build", source / "build")
    scene = Path(root) / "tests/regression/dry_3d.toml"
    run(program, "run", scene, "-o", source / "out", "--quiet", "--set", "soil.sand.friction_angle=30")
    expected = json.loads((source / "out/summary.json").read_text())["state_hash"]
    mpiexec = re.search(r"^MPIEXEC_EXECUTABLE:\w+=(.*)$", (BUILD / "CMakeCache.txt").read_text(), re.M)[1]
    for launcher in ([], [mpiexec, "-n", "2"]):
        said = run(*launcher, source / "build/mine", scene)
        check(f"state_hash {expected}" in said, f"{' '.join(launcher) or 'alone'}: {said.strip()}, the program's {expected}")
    # A wrong scene is an exception with the program's words.
    wrong = work / "wrong.toml"
    wrong.write_text(scene.read_text().replace("poisson", "poison"))
    done = subprocess.run([str(source / "build/mine"), str(wrong)], capture_output=True, text=True, timeout=100)
    check(done.returncode != 0 and "poison" in done.stderr, f"a misspelt key: {done.stderr.strip()[-200:]}")


def main():
    with tempfile.TemporaryDirectory(prefix="kuzure-install-") as folder:
        work = Path(folder)
        prefix = work / "prefix"
        run("cmake", "--install", BUILD, "--prefix", prefix)
        program = prefix / "bin/kuzure"
        for file in (
            "share/kuzure/scenes/quickstart.toml",
            "share/kuzure/machines/slurm.toml",
            "share/kuzure/paraview/kuzure_view.py",
            "lib/python3/dist-packages/kuzure/results.py",
            "share/kuzure/machines/slurm.job.sh",
            "share/doc/kuzure/README.md",
            "share/doc/kuzure/docs/tutorial.md",
            "share/bash-completion/completions/kuzure",
            "share/zsh/site-functions/_kuzure",
            "share/fish/vendor_completions.d/kuzure.fish",
            "share/man/man1/kuzure.1.gz",
        ):
            need((prefix / file).is_file() and (prefix / file).stat().st_size > 100, f"{file} was not installed")
        need(run(program, "--version") == run(PROGRAM, "--version"), "--version of the installed program")

        # The Python package beside it finds it; the gallery is its own.
        script = "import kuzure; print(kuzure.__file__, kuzure.program(), *kuzure.examples())"
        site = {"PYTHONPATH": str(prefix / "lib/python3/dist-packages"), "PATH": "/usr/bin:/bin", "KUZURE": ""}
        (prefix / "share/kuzure/scenes/elsewhere.toml").write_text((prefix / "share/kuzure/scenes/quickstart.toml").read_text())
        words = run("/usr/bin/python3", "-c", script, cwd=work, environment=site).split()
        need(
            words[0].startswith(str(prefix)) and words[1] == str(program) and "elsewhere" in words, f"the installed Python package: {words}"
        )

        # Its own profiles, not the sources': one that is only there is found.
        profile = prefix / "share/kuzure/machines/slurm.toml"
        (profile.parent / "elsewhere.toml").write_text(profile.read_text())
        job = run(program, "job", prefix / "share/kuzure/scenes/quickstart.toml", "--machine", "elsewhere", "--nodes", "1", cwd=work)
        need(f"'{program}'" in job and job.startswith("#!/bin/bash"), "the batch script does not start the installed program")

        # What a package has: the program under lib/kuzure, the launcher in bin. Scripts must start the launcher.
        inner = prefix / "lib/kuzure/x86-64/kuzure"
        inner.parent.mkdir(parents=True)
        program.rename(inner)
        program.write_text("stands for the launcher")
        job = run(inner, "job", prefix / "share/kuzure/scenes/quickstart.toml", "--machine", "elsewhere", "--nodes", "1", cwd=work)
        need(f"'{program}'" in job, "the batch script of a packaged program does not start the launcher")

        source = work / "consumer"
        source.mkdir()
        (source / "CMakeLists.txt").write_text(CMAKE)
        (source / "main.cpp").write_text(SOLVER)
        (source / "scene.cpp").write_text(SCENE)
        # With the build's own compiler and flags: a library of a sanitizer's build wants the sanitizer.
        flags = [
            f"-D{line}"
            for line in (BUILD / "CMakeCache.txt").read_text().splitlines()
            if line.startswith(("CMAKE_CXX_COMPILER:", "CMAKE_BUILD_TYPE:", "CMAKE_CXX_FLAGS"))
        ]
        run(
            "cmake",
            "-S",
            source,
            "-B",
            work / "build",
            f"-DCMAKE_PREFIX_PATH={prefix}",
            *flags,
            "-DCMAKE_DISABLE_FIND_PACKAGE_MPI=ON",
            "-DCMAKE_DISABLE_FIND_PACKAGE_HDF5=ON",
        )
        run("cmake", "--build", work / "build")
        for name in ("consumer", "scene_only"):
            if not (work / "build" / name).exists():  # its build has said why
                continue
            print(run(work / "build" / name), end="")
            linked = run("ldd", work / "build" / name)
            need("libmpi" not in linked and "hdf5" not in linked, f"{name} is linked with MPI or HDF5:\n{linked}")

        try_simulation(work, prefix, PROGRAM, flags)

        # The control: another version is refused.
        (source / "CMakeLists.txt").write_text(CMAKE.replace("kuzure 0.1", "kuzure 7.0"))
        run("cmake", "-S", source, "-B", work / "other", f"-DCMAKE_PREFIX_PATH={prefix}", expected=1)

    finish()


if __name__ == "__main__":
    main()
