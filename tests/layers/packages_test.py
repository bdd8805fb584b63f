#!/usr/bin/python3
"""The recipes for Apptainer and Spack say what the build wants: sections that Apptainer knows and sound shell in them, options that
CMakeLists.txt has, and a package for every library that it looks for. Neither tool is needed. Run as packages_test.py PROGRAM (which is
not used)."""
import os
import re
import subprocess
import sys
import types
from pathlib import Path

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, finish, root

ROOT = Path(root)
SECTIONS = {"arguments", "files", "post", "environment", "test", "runscript", "labels", "help"}
# What CMake calls a library whose package in Spack has another name; None: of the compiler, of tests, or part of another.
SPACK = {
    "openmp": None,
    "pkgconfig": "pkgconfig",
    "benchmark": None,
    "nlohmann_json": "nlohmann-json",
    "pangocairo": "pango",
    "libtiff-4": "libtiff",
    "png": "libpng",
}


def sections(text):
    """Of a definition file: {name: its lines}; what stands above the first is its header."""
    parts = re.split(r"^%(\w+)\n", text, flags=re.M)
    return parts[0], dict(zip(parts[1::2], parts[2::2]))


def sound_shell(script):
    return subprocess.run(["bash", "-n"], input=script, capture_output=True, text=True).returncode == 0


def test_apptainer(options):
    header, parts = sections((ROOT / "jobs/Apptainer.def").read_text())
    check(re.match(r"Bootstrap: \w+\nFrom: \S+\n", header) is not None, "Apptainer.def begins with Bootstrap and From")
    check(set(parts) <= SECTIONS and {"files", "post", "test", "runscript"} <= set(parts), f"its sections: {', '.join(parts)}")
    arguments = dict(line.strip().split("=") for line in parts["arguments"].splitlines() if line.strip())
    used = set(re.findall(r"{{ (\w+) }}", "".join(parts.values())))
    check(used == set(arguments), f"arguments that it uses, {used}, and gives, {set(arguments)}")
    for name in ("post", "test", "environment", "runscript"):
        check(sound_shell(re.sub(r"{{ \w+ }}", "x", parts[name])), f"%{name} is sound shell")
    check(not sound_shell("if true; then"), "and what is not would be seen")
    asked = set(re.findall(r"-D(KUZURE_\w+)", parts["post"]))
    check(asked and asked <= options, f"options of CMakeLists.txt: {asked}")
    for path in re.findall(r"\bjobs/\w+\.sh", parts["post"]):
        check((ROOT / path).exists(), f"{path} is there")


def spack_package():
    """package.py on a stand-in of Spack that keeps what the directives are given."""
    kept = {name: [] for name in ("license", "version", "variant", "depends_on", "conflicts", "generator")}
    stand_in = types.ModuleType("spack.package")

    class When:
        def __init__(self, spec):
            pass

        def __enter__(self):
            pass

        def __exit__(self, *_):
            pass

    class CMakePackage:
        spec = types.SimpleNamespace(target={"avx512f"})
        define = staticmethod(lambda key, value: f"-D{key}={value}")
        define_from_variant = staticmethod(lambda key, variant: f"-D{key}={variant}")

    for name, calls in kept.items():
        setattr(stand_in, name, lambda *given, calls=calls, **more: calls.append((given, more)))
    stand_in.when, stand_in.CMakePackage = When, CMakePackage
    stand_in.__all__ = [*kept, "when", "CMakePackage"]
    sys.modules["spack"], sys.modules["spack.package"] = types.ModuleType("spack"), stand_in
    path = ROOT / "jobs/spack/packages/kuzure/package.py"
    names = {"__file__": str(path), "__name__": "package"}
    exec(compile(path.read_text(), str(path), "exec"), names)
    return names["Kuzure"], kept


def test_spack(cmake, options):
    package, kept = spack_package()
    check(package.git == ROOT.resolve().as_uri(), f"the sources are these: {package.git}")
    asked = set(re.findall(r"-D(KUZURE_\w+)=", " ".join(package().cmake_args())))
    check(len(asked) == 5 and asked <= options, f"options of CMakeLists.txt: {asked}")
    packages = {given[0].split("@")[0].split()[0] for given, _ in kept["depends_on"]}
    wanted = re.findall(r"^ *find_package\((\w+)", cmake, re.M) + ["libgeotiff"]
    for line in re.findall(r"pkg_check_modules\(\w+ IMPORTED_TARGET ([^)]+)\)", cmake):
        wanted += line.split()
    for library in wanted:
        name = SPACK.get(library.lower(), library.lower())
        check(name is None or name in packages, f"{library}: {name}")


def main():
    cmake = (ROOT / "CMakeLists.txt").read_text()
    options = set(re.findall(r"(?:option|set)\((KUZURE_\w+)", cmake))
    test_apptainer(options)
    test_spack(cmake, options)
    finish()


if __name__ == "__main__":
    main()
