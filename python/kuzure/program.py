"""The program: where it is, and one call of it."""
import json
import os
import shutil
import subprocess
from pathlib import Path

from .errors import NoProgram, ProgramFailed


def program(path=None):
    """The path of the program `kuzure`: the one given, $KUZURE, that of the PATH, that beside this package, that of the build tree.

    Throws NoProgram, which names the places where it was looked for.
    """
    for what, asked in (("program=", path), ("$KUZURE", os.environ.get("KUZURE"))):
        if asked:
            found = shutil.which(str(asked))
            if not found:
                raise NoProgram(f"{what}{asked}: expected the program kuzure, found none that can be started")
            return found
    found = shutil.which("kuzure")
    if found:
        return found
    here = Path(__file__).resolve()
    # PREFIX/lib/python3/dist-packages/kuzure/program.py beside PREFIX/bin; python/kuzure/program.py in the sources.
    beside = [here.parents[4] / "bin/kuzure"] if len(here.parents) > 4 else []
    beside.append(here.parents[2] / "build/release/kuzure")
    for file in beside:
        if shutil.which(str(file)):
            return str(file)
    raise NoProgram(
        f"the program kuzure is neither in the PATH nor at {' nor '.join(map(str, beside))}: build it (jobs/build.sh release kuzure), "
        "or name it by program= or the environment variable KUZURE"
    )


def call(*words, path=None, expected=(0,), directory=None, launcher=(), show=False):
    """Runs the program to its end and gives what it said on standard output; throws ProgramFailed.

    With `show` its lines are printed as they come. Ctrl-C goes to the program too, which then writes a checkpoint: it is waited for.
    """
    command = [program(path), *map(str, words)]
    name = " ".join(["kuzure", *map(str, words)])
    process = subprocess.Popen(
        [*launcher, *command], stdout=subprocess.PIPE, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True, errors="replace"
    )
    try:
        out, complaints = _listen(process) if show else process.communicate()
    except KeyboardInterrupt:
        process.wait()
        raise
    if process.returncode not in expected:
        raise ProgramFailed(name, process.returncode, complaints or out[-2000:], directory)
    return out


def _listen(process):
    """Prints what the program says as it comes."""
    import threading

    complaints = []
    reader = threading.Thread(target=lambda: complaints.append(process.stderr.read()))
    reader.start()
    lines = []
    for line in process.stdout:
        print(line, end="", flush=True)
        lines.append(line)
    reader.join()
    process.wait()
    return "".join(lines), complaints[0]


def examples(program=None):
    """The ready scenes: {name: title}."""
    return {e["name"]: e["title"] for e in json.loads(call("example", "--json", path=program))}


def example(name, program=None):
    """The text of a ready scene, to be written to a file and changed."""
    return call("example", name, path=program)
