"""Runs and studies, started as `kuzure run` and `kuzure study`."""
import contextlib
import json
import os
import re
import shutil
import tempfile
from pathlib import Path

from . import toml
from .errors import Error
from .program import call
from .results import Run, Study


@contextlib.contextmanager
def _file_of(scene):
    """The file of a scene; one given as a dict is written for as long as it takes."""
    if not isinstance(scene, dict):
        yield os.fspath(scene)
        return
    with tempfile.TemporaryDirectory(prefix="kuzure-") as folder:
        file = Path(folder) / "scene.toml"
        file.write_text(toml.to_toml(scene), encoding="utf-8")
        yield str(file)


def run(
    scene,
    directory=None,
    *,
    threads=None,
    ranks=None,
    restart=False,
    force=False,
    twins=False,
    max_minutes=None,
    show=False,
    program=None,
    **sets,
):
    """Runs a scene to its end and gives its Run.

    scene: the path of a scene file, or a scene as nested dicts. directory: where results go (default: as the program chooses).
    sets: keys of the scene, as `space__spacing=0.1`, `space={"spacing": 0.1}` or `**{"space.spacing": 0.1}`.
    ranks: started by mpirun. show: print what the program says, its progress too.
    Throws ProgramFailed with the program's own words and exit code: 2 the scene is wrong and nothing was written, 3 the numbers failed,
    4 files failed, 5 stopped, a checkpoint was written (go on with restart=True).
    """
    words = []
    if isinstance(scene, dict) and directory is None:
        raise Error("a scene given as a dict has no file name after which its results could be called: give a directory")
    for name, given in (("-o", directory), ("--threads", threads), ("--max-minutes", max_minutes)):
        if given is not None:
            words += [name, os.fspath(given) if name == "-o" else given]
    words += [option for option, given in (("--restart", restart), ("--force", force), ("--twins", twins)) if given]
    if not show:
        words.append("--progress=none")
    launcher = []
    if ranks:
        if not shutil.which("mpirun"):
            raise Error(f"ranks={ranks}: mpirun is not in the PATH; install an MPI, or leave ranks out")
        launcher = ["mpirun", "-n", str(ranks)]
    with _file_of(scene) as file:
        said = call("run", file, *words, *toml.sets(sets), path=program, directory=directory, launcher=launcher, show=show)
    if directory is None:
        directory = re.findall(r"^results in (.*), to begin with report\.html$", said, re.M)[-1]
    return Run(directory, program=program)


def check(scene, program=None, **sets):
    """What `kuzure check --json` says of a scene: particles, steps, memory, predicted seconds, effects, warnings. Nothing is run."""
    with _file_of(scene) as file:
        return json.loads(call("check", file, "--json", *toml.sets(sets), path=program))


def study(sweep, directory, *, threads=None, show=False, program=None):
    """Runs a sweep file (docs/accuracy.md) and gives its Study; one that was begun goes on. Points that failed are in it, with their words."""
    words = ["--threads", threads] if threads is not None else []
    call("study", os.fspath(sweep), "-o", os.fspath(directory), *words, path=program, directory=directory, show=show)
    return Study(directory)
