"""Tables that grow while a run goes on: a line of names, a line of units, rows of numbers, and of words in columns without a unit."""
import csv
from pathlib import Path

import numpy

from .errors import DamagedFile, NotARun


class Table(dict):
    """Columns by name, as arrays; `units` of each. What stands in for a DataFrame where pandas is not there."""

    def __init__(self, columns, units):
        super().__init__(columns)
        self.units = units

    @property
    def columns(self):
        return list(self)

    def __getattr__(self, name):
        if name in self:
            return self[name]
        raise AttributeError(f"no column {name}; there are {', '.join(self)}")


def read_table(file):
    """A Table of a CSV of the program. A torn last row, of a run that goes on or was killed, is left out.

    Throws NotARun where the file is missing, DamagedFile with the line that is wrong.
    """
    file = Path(file)
    try:
        text = file.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise NotARun(f"{file}: no such file: the run has not written it") from None
    except (OSError, UnicodeDecodeError) as e:
        raise DamagedFile(f"{file}: {e}") from None
    lines = text.split("\n")
    torn = len(lines) > 2 and lines[-1] != ""  # a whole row ends with a line's end
    if not torn and lines[-1] == "":
        lines.pop()
    if len(lines) < 2 or not lines[1].startswith("#"):
        raise DamagedFile(f"{file}: expected a line of names and one of units that begins with #, found {text[:60]!r}")
    names, units = lines[0].split(","), lines[1][1:].strip().split(",")
    if len(units) != len(names):
        raise DamagedFile(f"{file}:2: expected {len(names)} units, one a column, found {len(units)}")
    words = [not unit.strip() for unit in units]
    rows = []
    for number, line in enumerate(lines[2 : -1 if torn else None], 3):
        cells = next(csv.reader([line]), [])
        try:
            rows.append([cell if word else float(cell) for cell, word in zip(cells, words)])
        except ValueError:
            raise DamagedFile(f"{file}:{number}: expected numbers, found {line[:80]!r}") from None
        if len(cells) != len(names):
            raise DamagedFile(f"{file}:{number}: expected {len(names)} cells, found {len(cells)}")
    columns = {name: numpy.array([row[k] for row in rows], dtype=str if words[k] else float) for k, name in enumerate(names)}
    if "step" in columns:
        columns["step"] = columns["step"].astype(numpy.int64)
    return Table(columns, dict(zip(names, units)))


def frame(table):
    """The table as a DataFrame where pandas is there, its units in `.attrs["units"]`; else as it is."""
    try:
        import pandas
    except ImportError:
        return table
    data = pandas.DataFrame(dict(table))
    data.attrs["units"] = table.units
    return data
