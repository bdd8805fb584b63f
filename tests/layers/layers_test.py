#!/usr/bin/python3
"""Includes point one way; files and functions have one job: a long one says why it is. Run as layers_test.py PROGRAM (which is not used); exits 1 and names file and line of what breaks a rule."""
import re
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]

# A layer and the layers or single files that it may include beside itself.
LAYERS = {
    "solver/core": [],
    "solver/scene": ["solver/core"],
    "solver/physics": ["solver/core", "solver/scene"],
    "solver/neighbours": ["solver/core", "solver/scene", "solver/physics"],
    "solver/pairs": ["solver/core", "solver/scene"],
    "solver/effects": ["solver/core", "solver/scene", "solver/physics", "solver/pairs"],
    "solver/walls": ["solver/core", "solver/scene", "solver/pairs"],
    "solver/kernels": [
        "solver/core",
        "solver/scene",
        "solver/physics",
        "solver/neighbours",
        "solver/pairs",
        "solver/effects",
        "solver/walls",
    ],
    "solver/run": [
        "solver/core",
        "solver/scene",
        "solver/physics",
        "solver/neighbours",
        "solver/pairs",
        "solver/effects",
        "solver/walls",
        "solver/kernels",
        "decomposition",
        "perf",
    ],
    "decomposition": ["solver/core", "solver/scene"],
    "io": ["solver/core", "solver/scene"],
    "perf/bench": ["solver", "decomposition", "io", "perf"],
    "perf": ["solver/core/team.hpp"],
    "solver/api": ["solver/core", "solver/scene", "solver/run", "decomposition", "io"],
    "solver/app": ["solver", "decomposition", "io", "perf"],
    "tests": ["solver", "decomposition", "io", "perf"],
}
# Foreign headers that only one place may include; "deep": nor may others get them through a header of that place.
FOREIGN = [
    (r"mpi(-ext|io)?\.h", "decomposition", "deep"),
    (r"(par)?metis\.h", "decomposition", "deep"),
    (r"(hdf5(_hl)?|H5\w+)\.h", "io", "deep"),
    (r"toml\+\+/.*|toml\.hpp", "io", "deep"),
    (r"(proj\w*|x?tiffio|geo\w+|shapefil|archive\w*)\.h|pugixml\.hpp", "io/ground", "deep"),
    (r".*intrin\.h|arm_(neon|sve)\.h|experimental/simd", "solver/core/simd.hpp", "direct"),
]
FOLDERS = {"solver", "decomposition", "io", "perf", "python", "jobs", "tests", "docs", "cmake"}
GENERATED = {"build", "results"}
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')


# Headers that no intrinsics come through: every file that includes them would pay half a second of the compiler's time.
PLAIN = ("solver/core", "solver/scene", "decomposition", "io")


# A file of more lines than this says at its top why, in words that begin so.
LONG, REASON = 420, "beyond 400 lines:"
# A function of more lines than this, its body's braces included, is several; those that are not, and why.
LONG_FUNCTION = 60
LONG_FUNCTIONS = {
    ("solver/kernels/strain.hpp", "update_strain"): "the update of a cluster, in the order of its equations and in registers",
    ("solver/kernels/staggered_by_the_book.hpp", "force_on"): "the force as it is printed, term after term",
    ("io/machine_profile.cpp", "make_keys"): "a table, one row a key",
}


def inside(path, place):
    return path == place or path.startswith(place + "/")


def layer_of(path):
    return max((layer for layer in LAYERS if inside(path, layer)), key=len, default=None)


def sources(root):
    """Path from the root -> [(line number, is quoted, what it includes)] of every C++ file."""
    found = {}
    for folder in sorted(FOLDERS):
        for file in sorted((root / folder).rglob("*")):
            if file.suffix in (".hpp", ".cpp", ".h", ".cc", ".hh", ".inl") and file.is_file():
                lines = file.read_text(errors="replace").splitlines()
                found[file.relative_to(root).as_posix()] = [
                    (k, m[1] == '"', m[2]) for k, line in enumerate(lines, 1) if (m := INCLUDE.match(line))
                ]
    return found


def foreign_through(path, includes, pattern, seen):
    """The chain of project headers by which a file comes to a foreign header, or None."""
    seen.add(path)
    for _, _, what in includes.get(path, []):
        if re.fullmatch(pattern, what):
            return [path, f"<{what}>"]
        if what in includes and what not in seen and (onward := foreign_through(what, includes, pattern, seen)):
            return [path, *onward]
    return None


def violations(root, top_level):
    includes = sources(root)
    if not includes:
        yield f"{root}: no sources found"
    for name in sorted(top_level):
        if name not in FOLDERS | GENERATED and not name.startswith("."):
            yield f"{name}/: not one of the top-level folders {', '.join(sorted(FOLDERS))}"
    for path in includes:
        if path.endswith(".hpp") and any(inside(path, place) for place in PLAIN):
            chain = foreign_through(path, includes, r"immintrin\.h", set())
            if chain and len(chain) > 2:
                yield f"{path}:1: comes to intrinsics through {' -> '.join(chain[1:-1])}: solver/core/scalar.hpp does without"
    for path, lines in includes.items():
        layer = layer_of(path)
        if layer is None:
            yield f"{path}: a source outside every layer"
            continue
        for k, quoted, what in lines:
            for pattern, place, _ in FOREIGN:
                if re.fullmatch(pattern, what) and not inside(path, place):
                    yield f"{path}:{k}: includes {what}, which only {place} may"
            own = what in includes
            if quoted and not own:
                yield f'{path}:{k}: "{what}" is no file of the project as seen from its root'
            if own and not quoted:
                yield f"{path}:{k}: <{what}> is the project's own: write it in quotes"
            if own and layer_of(what) != layer and not any(inside(what, allowed) for allowed in LAYERS[layer]):
                yield f"{path}:{k}: {layer} may not include {what}"
            for pattern, place, depth in FOREIGN:
                if own and depth == "deep" and not inside(path, place):
                    chain = foreign_through(what, includes, pattern, set())
                    # Said where a file of that place is included from outside it, not again by everything above.
                    if chain and inside(what, place):
                        yield f"{path}:{k}: comes to {chain[-1]} through {' -> '.join(chain[:-1])}"


def too_long(root):
    for folder in sorted(FOLDERS):
        for file in sorted((root / folder).rglob("*")):
            if file.suffix not in (".hpp", ".cpp", ".py", ".sh") or not file.is_file():
                continue
            path, lines = file.relative_to(root).as_posix(), file.read_text(errors="replace").splitlines()
            if len(lines) > LONG and not any(REASON in line.lower() for line in lines[:40]):
                yield f"{path}:{len(lines)}: longer than {LONG} lines: split it, or say at its top why it is one file: // Beyond 400 lines: ..."


def functions(lines):
    """(line, name, lines of its body) of the functions in C++ as .clang-format lays it out: braces of bodies stand alone, at the indent of
    what they belong to."""
    opened = {}
    for k, line in enumerate(lines):
        if not (brace := re.fullmatch(r"( *)([{}])", line)):
            continue
        indent = len(brace[1])
        if brace[2] == "{":
            opened[indent] = k
        elif (begin := opened.pop(indent, None)) is not None:
            head = begin - 1
            while head > 0 and (lines[head].startswith(" " * (indent + 1)) or not lines[head].strip()):
                head -= 1
            if name := re.search(r"([\w~:]+|operator\S+)\(", re.sub(r"\[\[.*?\]\]", "", " ".join(lines[head:begin]))):
                yield begin + 1, name[1].split("::")[-1], k - begin + 1


def long_functions(root, exceptions):
    unused = dict(exceptions)
    for folder in ("solver", "decomposition", "io", "perf"):
        for file in sorted((root / folder).rglob("*.?pp")):
            path = file.relative_to(root).as_posix()
            for line, name, n in functions(file.read_text(errors="replace").splitlines()):
                if n > LONG_FUNCTION and unused.pop((path, name), None) is None:
                    yield f"{path}:{line}: {name}() has {n} lines: cut it into named functions of at most {LONG_FUNCTION}"
    for path, name in unused:
        yield f"{path}: {name}() is no longer long: take it from the list of this test"


def top_level_folders(root):
    """Folders that git keeps; without git, those that are there."""
    try:
        listing = subprocess.run(["git", "-C", str(root), "ls-files", "-z"], capture_output=True, text=True, check=True)
        return {name.split("/")[0] for name in listing.stdout.split("\0") if "/" in name}
    except (OSError, subprocess.CalledProcessError):
        return {entry.name for entry in root.iterdir() if entry.is_dir()}


PLANTED = {  # file, its text, what must be said of it ("" for nothing)
    "solver/core/simd.hpp": ("#include <immintrin.h>\n", ""),
    "solver/core/team.hpp": ("#include <span>\n", ""),
    "solver/core/up.hpp": ('#include "solver/scene/scene.hpp"\n', "solver/core may not include solver/scene/scene.hpp"),
    "solver/scene/scene.hpp": ('#include "solver/core/simd.hpp"\n', "comes to intrinsics through solver/core/simd.hpp"),
    "solver/physics/wide.hpp": ("#  include <x86intrin.h> // why\n", "includes x86intrin.h"),
    "solver/physics/loop.hpp": ('#include "solver/kernels/scheme.hpp"\n', "solver/physics may not include"),
    "solver/neighbours/sums.hpp": ('#include "solver/pairs/sums.hpp"\n', "solver/neighbours may not include"),
    "solver/pairs/sums.hpp": ('#include "solver/core/simd.hpp"\n', ""),
    "solver/pairs/term.hpp": ('#include "solver/effects/term.hpp"\n', "solver/pairs may not include"),
    "solver/effects/term.hpp": ('#include "solver/physics/wide.hpp"\n#include "solver/pairs/sums.hpp"\n', ""),
    "solver/effects/early.hpp": ('#include "solver/kernels/scheme.hpp"\n', "solver/effects may not include"),
    "solver/effects/near.hpp": ('#include "term.hpp"\n', "no file of the project"),
    "solver/walls/law.hpp": ('#include "solver/pairs/sums.hpp"\n#include "solver/scene/scene.hpp"\n', ""),
    "solver/walls/wet.hpp": ('#include "solver/effects/term.hpp"\n', "solver/walls may not include"),
    "solver/kernels/scheme.hpp": ('#include "solver/effects/term.hpp"\n#include "solver/walls/law.hpp"\n', ""),
    "solver/kernels/late.hpp": ('#include "solver/run/clock.hpp"\n', "solver/kernels may not include"),
    "solver/run/clock.hpp": ('#include "solver/kernels/scheme.hpp"\n#include "perf/report.hpp"\n', ""),
    "solver/run/scene.cpp": ('#include "io/file.cpp"\n', "solver/run may not include"),
    "solver/run/early.cpp": ('#include "solver/app/cli/command.hpp"\n', "solver/run may not include"),
    "solver/app/cli/command.hpp": ('#include "solver/run/clock.hpp"\n', ""),
    "solver/effects/angle.hpp": ("#include <solver/core/team.hpp>\n", "write it in quotes"),
    "decomposition/comm.hpp": ("#include <mpi.h>\n", ""),
    "decomposition/cut.hpp": ('#include "decomposition/comm.hpp"\n#include <metis.h>\n', ""),
    "decomposition/file.cpp": ("#include <hdf5.h>\n", "includes hdf5.h, which only io may"),
    "io/file.cpp": ('#include <hdf5.h>\n#include <toml++/toml.h>\n#include "solver/core/team.hpp"\n', ""),
    "io/ranks.cpp": ('#include "decomposition/comm.hpp"\n', "io may not include decomposition/comm.hpp"),
    "io/direct.cpp": ("#include <mpi.h>\n", "includes mpi.h, which only decomposition may"),
    "perf/report.hpp": ('#include "solver/core/team.hpp"\n', ""),
    "perf/greedy.hpp": ('#include "solver/core/simd.hpp"\n', "perf may not include solver/core/simd.hpp"),
    "perf/bench/rates.cpp": ('#include "solver/kernels/scheme.hpp"\n', ""),
    "solver/app/main.cpp": ('#include "perf/report.hpp"\n', ""),
    "solver/app/cut.cpp": (
        '#include "decomposition/cut.hpp"\n',
        "comes to <mpi.h> through decomposition/cut.hpp -> decomposition/comm.hpp",
    ),
    "solver/app/scene.cpp": ("#include <toml++/toml.h>\n", "which only io may"),
    "tests/unit/metis_test.cpp": ("#include <metis.h>\n", "includes metis.h"),
    "jobs/tool.cpp": ("#include <span>\n", "outside every layer"),
}


def check_the_check():
    """Every planted violation must be found, and nothing else."""
    with tempfile.TemporaryDirectory() as folder:
        root = Path(folder)
        for path, (text, _) in PLANTED.items():
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).write_text(text)
        (root / "misc").mkdir()
        said = list(violations(root, {entry.name for entry in root.iterdir()}))
        for name, top in (("long", ""), ("reason", "// Beyond 400 lines: one table.\n")):
            (root / f"io/{name}.cpp").write_text(top + "\n" * LONG + "int x;\n")
        long = [line.split(":")[0] for line in too_long(root)]
        body = "    x;\n" * (LONG_FUNCTION - 1)
        method = "struct A {\n    int method(int a,\n               int b)\n    {\n" + body + "    }\n};\n"
        plain = f"int listed()\n{{\n{body}}}\nint fits()\n{{\n{body[:-7]}}}\ntemplate <class T>\nT K<T>::wide()\n{{\n{body}}}\n"
        (root / "io/functions.cpp").write_text(method + plain)
        functions_found = [line.split("()")[0].split(" ")[-1] for line in long_functions(root, {("io/functions.cpp", "listed"): "why"})]
        stale = list(long_functions(root, {("io/file.cpp", "gone"): "why"}))[-1]
    wrong = []
    if long != ["io/long.cpp"]:
        wrong.append(f"self-check: the long files found are {long}")
    if functions_found != ["method", "wide"] or "gone() is no longer long" not in stale:
        wrong.append(f"self-check: the long functions found are {functions_found}, {stale}")
    for path, (_, expected) in PLANTED.items():
        about = [line for line in said if re.match(re.escape(path) + ":", line)]
        if (not expected and about) or (expected and not any(expected in line for line in about)):
            wrong.append(f"self-check: {path}: expected {expected or 'nothing'!r}, got {about}")
    if not any(line.startswith("misc/:") for line in said):
        wrong.append("self-check: the folder misc was not found")
    return wrong


def main():
    wrong = check_the_check() or [*violations(ROOT, top_level_folders(ROOT)), *too_long(ROOT), *long_functions(ROOT, LONG_FUNCTIONS)]
    print("\n".join(wrong) if wrong else f"includes point one way in {len(sources(ROOT))} files")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
