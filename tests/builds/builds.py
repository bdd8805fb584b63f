"""What the tests of other compilers, MPI libraries and architectures share. Nothing here is a test."""
import json
import os
import re
import shutil
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import check, program, root

os.environ.setdefault("OMP_NUM_THREADS", "1")


def need_tools(*tools):
    """Ends this test with 77, not run, where one of them is not on this machine."""
    missing = [tool for tool in tools if not (os.path.exists(tool) or shutil.which(tool))]
    if missing:
        print(f"not run: {', '.join(missing)} is not there; jobs/install.sh builds installs it")
        sys.exit(77)


def build(preset, *targets):
    """Builds these targets of a preset with the options of the build under test, and gives the directory."""
    command = [os.path.join(root, "jobs/build.sh"), preset, *targets]
    done = subprocess.run(command, capture_output=True, text=True, timeout=7000)
    if not check(done.returncode == 0, f"{preset} builds {' '.join(targets)} {done.stderr.strip()[-600:]}"):
        sys.exit(1)
    return os.path.join(root, "build", preset)


def names(*globs):
    """The test programs of these folders of tests/, long ones left out."""
    return [
        f[:-4] for g in globs for f in sorted(os.listdir(os.path.join(root, "tests", g))) if re.fullmatch(r"\w+(?<!_long)_test\.cpp", f)
    ]


def suite(directory, what, *arguments):
    """Tests of a build directory: all that ctest chooses by these arguments pass, and there are some."""
    done = subprocess.run(
        ["ctest", "--test-dir", directory, "--output-on-failure", *arguments], capture_output=True, text=True, timeout=7000
    )
    said = re.search(r"(\d+)% tests passed, (\d+) tests failed out of (\d+)", done.stdout)
    good = done.returncode == 0 and said and int(said[3]) > 0
    check(good, f"{what}: {said[0] if said else ''}" + ("" if good else done.stdout[-3000:] + done.stderr[-500:]))


def version(command):
    return subprocess.run([*command, "--version"], capture_output=True, text=True, check=True).stdout.strip().replace("\n", ", ")


def state(command, scene, out, *sets):
    """The summary of a run of this scene by a command that starts kuzure."""
    more = [word for s in sets for word in ("--set", s)]
    done = subprocess.run([*command, "run", scene, "-o", out, "--quiet", "--force", *more], capture_output=True, text=True, timeout=7000)
    if not check(done.returncode == 0, f"{out}: exit {done.returncode} {done.stderr.strip()[-400:]}"):
        sys.exit(1)
    with open(os.path.join(out, "summary.json")) as f:
        return json.load(f)


def same_bits(commands, scene, work, *sets):
    """Each of {words: command} gives the bits of the program under test."""
    expected = state([program], scene, os.path.join(work, "expected"), *sets)
    for k, (words, command) in enumerate(commands.items()):
        got = state(command, scene, os.path.join(work, str(k)), *sets)
        check(
            got["state_hash"] == expected["state_hash"] and got["steps"] == expected["steps"] > 0,
            f"{words}: state_hash {got['state_hash']}, {expected['state_hash']} by the program under test, {got['steps']} steps",
        )


def reference_bits(kuzure):
    """kuzure gives what tests/regression keeps: four scenes, their hashes and energies."""
    script = os.path.join(root, "tests/regression/regression_test.py")
    done = subprocess.run([sys.executable, script, kuzure], capture_output=True, text=True, timeout=7000)
    lines = [line for line in done.stdout.splitlines() if "state_hash" in line or line.startswith("FAIL")]
    check(done.returncode == 0, "tests/regression:\n  " + "\n  ".join(lines) + done.stderr[-500:])
