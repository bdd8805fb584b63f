"""What a run leaves in its directory, read; docs/running.md says what is in the files."""
import json
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import h5py
import numpy

from . import figures, tables
from .errors import DamagedFile, NotARun
from .program import call
from .tables import Table

__all__ = ["Run", "Snapshot", "Snapshots", "Study", "Surface", "Table"]

AXES = {3: ("x", "y", "z"), 6: ("xx", "yy", "zz", "xy", "yz", "xz")}


def _json(file):
    try:
        with open(file, encoding="utf-8") as f:
            return json.load(f)
    except FileNotFoundError:
        raise NotARun(f"{file}: no such file: the run has not written it") from None
    except (OSError, ValueError) as e:
        raise DamagedFile(f"{file}: {e}") from None


class Snapshot(Mapping):
    """The soil at one time: arrays by name, particles in the order of their ids.

    `position` (m), `id`, `soil` and the fields of [output]; components by `stress_zz`, `velocity_x`. `time` (s), `step`, `title`,
    `units` of each array. Arrays are read when they are asked for, and kept.
    """

    def __init__(self, file, kind=0):
        self.file, self._kind, self._arrays = Path(file), kind, {}
        with self._open() as f:
            top = f["VTKHDF"]
            self.time, self.step = float(top.attrs["time"]), int(top.attrs["step"])
            title = top.attrs["title"]
            self.title = title.decode() if isinstance(title, bytes) else str(title)
            self.failed_particle = int(top.attrs["failed_particle"]) if "failed_particle" in top.attrs else None
            data = top["PointData"]
            self._names = ["position"] + [name for name in data if name != "kind"]
            self.units = {"position": "m"}
            for name in self._names[1:]:
                unit = data[name].attrs.get("unit", "1")
                self.units[name] = unit.decode() if isinstance(unit, bytes) else str(unit)
            self._rows = numpy.nonzero(data["kind"][:] == kind)[0]
            self._rows = self._rows[numpy.argsort(data["id"][:][self._rows], kind="stable")]

    class _Opened:
        """The file, open; whatever HDF5 says of it is a DamagedFile."""

        def __init__(self, file):
            self.file = file

        def __enter__(self):
            if not self.file.exists():
                raise NotARun(f"{self.file}: no such file")
            try:
                self.hdf = h5py.File(self.file, "r")
            except OSError as e:
                raise DamagedFile(f"{self.file}: not a snapshot that can be read: {e}") from None
            return self.hdf

        def __exit__(self, kind, error, trace):
            self.hdf.close()
            if isinstance(error, (OSError, KeyError, RuntimeError, ValueError, IndexError)) and not isinstance(error, DamagedFile):
                raise DamagedFile(f"{self.file}: not a whole snapshot: {error}") from None

    def _open(self):
        return self._Opened(self.file)

    def __len__(self):
        return len(self._names)

    def __iter__(self):
        return iter(self._names)

    @property
    def size(self):
        """How many particles."""
        return len(self._rows)

    def __getitem__(self, name):
        if name not in self._names:
            whole, _, part = name.rpartition("_")
            axes = AXES.get(self[whole].shape[-1] if whole in self._names and self[whole].ndim == 2 else 0, ())
            if part in axes:
                return self[whole][:, axes.index(part)]
            raise KeyError(f"{name}: not in {self.file}, which has {', '.join(self._names)}")
        if name not in self._arrays:
            with self._open() as f:
                table = f["VTKHDF/Points"] if name == "position" else f["VTKHDF/PointData"][name]
                self._arrays[name] = table[:][self._rows]
        return self._arrays[name]

    def __repr__(self):
        return f"<snapshot at {self.time:g} s, {self.size} particles: {', '.join(self._names)}>"


class Snapshots(Sequence):
    """The snapshots of a run in order of time, each opened when it is asked for."""

    def __init__(self, directory):
        self.files = sorted(f for f in Path(directory, "snapshots").glob("state_*.hdf") if re.fullmatch(r"state_\d{6}\.hdf", f.name))
        if not self.files:
            raise NotARun(f"{directory}/snapshots: no snapshot is there")

    def __len__(self):
        return len(self.files)

    def __getitem__(self, k):
        return [Snapshot(f) for f in self.files[k]] if isinstance(k, slice) else Snapshot(self.files[k])

    @property
    def times(self):
        """Of all snapshots, s."""
        return numpy.array([s.time for s in self])


class Surface:
    """How high the soil stands along the way it spreads, as `kuzure surface` measures it.

    `at` (m): x in a plane and, in 3-D, in a band through the middle, or the distance from the axis (`spread`); `height` (m) there;
    `runout` (m) beyond where the soil stood; `top` (m); `start` (m) where it stood; `time` (s).
    """

    def __init__(self, facts):
        self.time, self.spread, self.window = facts["time"], facts["spread"], facts["window"]
        self.start, self.top, self.runout = tuple(facts["start"]), facts["top"], facts["runout"]
        self.at, self.height = numpy.array(facts["at"]), numpy.array(facts["height"])


class Run:
    """A result directory of kuzure, of a run that has ended or is going on."""

    def __init__(self, directory, program=None):
        self.directory, self._program = Path(directory), program
        if not self.directory.exists():
            raise NotARun(f"{directory}: no such directory")
        if not (self.directory / "scene.toml").exists():
            raise NotARun(f"{directory}: expected the result directory of a run, found no scene.toml in it")

    def __repr__(self):
        return f"<run in {self.directory}>"

    @property
    def summary(self):
        """summary.json: status, steps, energies, state_hash, effects with their reasons, error bars of --twins ..."""
        return _json(self.directory / "summary.json")

    @property
    def history(self):
        """history.csv: energies (J, in 2-D J/m), height and fronts (m) over time; a DataFrame where pandas is there, else a Table."""
        return self.table("history")

    def table(self, name):
        """One of the tables: "history", "progress", "forces", "probes", "events", or "front" of a run with maps."""
        return tables.frame(tables.read_table(self.directory / f"{name}.csv"))

    @property
    def snapshots(self):
        """All snapshots, in order of time."""
        return Snapshots(self.directory)

    def snapshot(self, t=None):
        """The snapshot whose time is next to t (s); the last without one."""
        all_of_them = self.snapshots
        return all_of_them[-1 if t is None else int(numpy.argmin(numpy.abs(all_of_them.times - t)))]

    @property
    def walls(self):
        """The wall particles: a Snapshot of points. Where events change walls, those at the end (Snapshot(file, kind=1) of any other)."""
        alone = self.directory / "snapshots/walls.hdf"
        return Snapshot(alone if alone.exists() else self.snapshots[-1].file, kind=1)

    def surface(self, t=None, window=None):
        """The Surface at the snapshot next to t (s; the last without one), its heights taken over `window` (m)."""
        words = [w for option, given in (("--at", t), ("--window", window)) if given is not None for w in (option, repr(float(given)))]
        return Surface(json.loads(call("surface", self.directory, "--json", *words, path=self._program)))

    def front(self):
        """How far the soil reaches over time: a Table of time (s), min_x, max_x, min_y, max_y (m)."""
        history = tables.read_table(self.directory / "history.csv")
        names = {"time": "time", **{f"front_{end}": end for end in ("min_x", "max_x", "min_y", "max_y")}}
        return tables.frame(
            Table({new: history[old] for old, new in names.items()}, {new: history.units[old] for old, new in names.items()})
        )

    def picture(self, t=None, color=None, view=None, range=None, file=None):
        """A picture drawn by `kuzure picture`, of the snapshot next to t (s; the last without one); gives its path."""
        file = (
            Path(file)
            if file
            else self.directory / f"picture_{color or 'own'}_{view or 'own'}_{'end' if t is None else format(t, 'g')}.png"
        )
        words = ["-o", str(file)]
        for option, given in (("--color", color), ("--view", view), ("--at", t)):
            words += [option, str(given)] if given is not None else []
        words += ["--range", *(repr(float(r)) for r in range)] if range else []
        call("picture", self.directory, *words, path=self._program)
        return file

    def plot(self, *columns, axes=None):
        """Columns of history.csv over time (without any: height and front) on matplotlib's axes, which it gives."""
        return figures.plot(self, columns, axes)

    def study(self, vary, directory, measures=("profile", "run-out", "height"), threads=1, show=False):
        """This run's scene over a table of settings: {"space.spacing": [0.1, 0.05]}, lists multiply. Gives the Study.

        The sweep that it writes, DIRECTORY.sweep.toml, may be changed and run again by `kuzure study` (docs/accuracy.md).
        """
        from .running import study
        from .toml import to_toml

        sweep = Path(f"{directory}.sweep.toml")
        sweep.parent.mkdir(parents=True, exist_ok=True)
        text = {
            "title": f"study of {self.directory.name}",
            "scene": str((self.directory / "scene.toml").resolve()),
            "measures": list(measures),
        }
        sweep.write_text(to_toml({**text, "vary": vary}), encoding="utf-8")
        return study(sweep, directory, threads=threads, show=show, program=self._program)


class Study:
    """A directory of `kuzure study`: `points` (dicts: curve, settings, values and errors by measure, core_seconds), `facts` (study.json)."""

    def __init__(self, directory):
        self.directory = Path(directory)
        if not (self.directory / "study.json").exists():
            raise NotARun(f"{directory}: expected the directory of a study, found no study.json in it")
        self.facts = _json(self.directory / "study.json")
        self.points = self.facts["points"]

    def run(self, k):
        """The Run of point k."""
        return Run(self.directory / "points" / self.points[k]["folder"] / "run")

    def __repr__(self):
        return f"<study in {self.directory}, {len(self.points)} points>"
