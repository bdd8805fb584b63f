"""kuzure from Python: start runs of the program and read what they leave.

    import kuzure
    run = kuzure.run("bank.toml", "results/bank", **{"space.spacing": 0.1})
    run.history["height"], run.snapshot(0.5)["velocity"], run.surface().height, run.front()

Everything that is computed is computed by the program `kuzure`: this package starts it and reads its files. SI units throughout.
"""
from .errors import DamagedFile, Error, NotARun, NoProgram, ProgramFailed
from .program import example, examples, program
from .results import Run, Snapshot, Study, Surface, Table
from .running import check, run, study
from .toml import to_toml

__all__ = [
    "DamagedFile",
    "Error",
    "NoProgram",
    "NotARun",
    "ProgramFailed",
    "Run",
    "Snapshot",
    "Study",
    "Surface",
    "Table",
    "check",
    "example",
    "examples",
    "program",
    "run",
    "study",
    "to_toml",
]
__version__ = "0.1.0"
