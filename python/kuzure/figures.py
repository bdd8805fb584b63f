"""Curves over time, by matplotlib, which is needed for nothing else."""
from . import tables
from .errors import Error


def _pyplot():
    try:
        import matplotlib.pyplot
    except ImportError:
        raise Error("plot() needs matplotlib, which is not there: install it (Debian: python3-matplotlib), or use .history") from None
    return matplotlib.pyplot


def plot(run, columns, axes=None):
    """The columns of a run's history over time, those of one unit on one axis."""
    history = tables.read_table(run.directory / "history.csv")
    columns = columns or ("height", "front_max_x")
    unknown = [c for c in columns if c not in history]
    if unknown:
        raise KeyError(f"{unknown[0]}: not in history.csv, which has {', '.join(history)}")
    units = {history.units[c] for c in columns}
    if len(units) > 1:
        raise Error(f"{', '.join(columns)} have different units ({', '.join(sorted(units))}): draw each unit on axes of its own")
    axes = axes if axes is not None else _pyplot().subplots()[1]
    for name in columns:
        axes.plot(history["time"], history[name], label=name.replace("_", " "))
    axes.set_xlabel("time (s)")
    axes.set_ylabel(units.pop() if len(columns) > 1 else f"{columns[0].replace('_', ' ')} ({history.units[columns[0]]})")
    axes.legend()
    return axes
