#!/usr/bin/python3
"""kuzure run --twins in legs: the coarser twins obey the clock, STOP and signals, and a restart goes on with them where they stood, until the
bits and the error bars are those of a run never stopped. Run as twins_test.py PROGRAM."""
import json
import os
import signal
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import block, check, failures, finish, legs, program, scratch, wait_for

work = scratch("twins")
os.environ["OMP_NUM_THREADS"] = "1"

SCENE = block(
    (0.64, 0, 0.64),
    ((-0.96, 0, -0.32), (1.6, 0, 0)),
    title="a block with twins",
    spacing=0.02,
    end=0.4,
    step=None,
    effects="viscosity = { alpha = 0.1, beta = 0.0 }",
    output="history = 0.01",
)


def start(out, *args):
    return subprocess.Popen(
        [program, "run", "s.toml", "-o", out, "--twins", "--restart", *args],
        cwd=work,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def end(process, expect, what):
    out, err = process.communicate(timeout=600)
    check(process.returncode == expect, f"{what}: exit {process.returncode}, expected {expect} {err[-300:]}")
    return out, err


def summary(path):
    try:
        return json.load(open(f"{work}/{path}/summary.json"))
    except FileNotFoundError:
        return {}


def main():
    with open(work + "/s.toml", "w") as f:
        f.write(SCENE)
    end(start("whole"), 0, "never stopped")
    whole = summary("whole")
    check({"run-out", "height", "peak speed"} <= set(whole.get("error_bars", {})), "it has error bars")
    # ---- legs by the clock: each must come further than the one before
    count, before = 0, -1
    for minutes in legs(sum(summary(d)["wall_seconds"] for d in ("whole/twins/x2", "whole/twins/x4", "whole"))):
        count += 1
        process = start("legs", "--max-minutes", minutes)
        out, err = process.communicate(timeout=600)
        if process.returncode == 0 or failures:
            break
        check(process.returncode == 5, f"leg {count}: exit {process.returncode} {err[-300:]}")
        done = sum(summary(d).get("time", 0) for d in ("legs/twins/x2", "legs/twins/x4", "legs"))
        check(
            done >= before and not os.path.exists(work + "/legs.old-1"),
            f"leg {count} came to {done:.3f} s in all, the one before to {before:.3f} s",
        )
        check("checkpoint" in out and "--restart" in out, f"leg {count} names a checkpoint")
        before = done
    check(count > 2, f"it took {count} legs")
    last = summary("legs")
    check(last.get("status") == "finished" and last.get("state_hash") == whole["state_hash"], "in legs: the same bits")

    def told(bars):
        return {**bars, "twins": [{k: v for k, v in t.items() if k != "wall_seconds"} for t in bars["twins"]]}

    check(told(last["error_bars"]) == told(whole["error_bars"]), "in legs: the same error bars, and the peak speed of all legs")
    for twin in ("x2", "x4"):
        check(
            summary(f"legs/twins/{twin}").get("state_hash") == summary(f"whole/twins/{twin}").get("state_hash"),
            f"in legs: the bits of twin {twin}",
        )
    # ---- STOP in the run's own directory, and a signal, while a twin runs
    for what in ("STOP", "signal"):
        # STOP is looked for once a second, and this process may be away for some: the first twin has millions of steps to make.
        process = start(what, "--set", "time.end=8000", "--set", "output.history=100")
        check(wait_for(lambda: os.path.exists(f"{work}/{what}/twins/x4/history.csv"), process=process), f"{what}: a twin runs")
        if what == "STOP":
            open(f"{work}/{what}/STOP", "w").close()
        else:
            process.send_signal(signal.SIGTERM)
        end(process, 5, f"{what} while a twin runs")
        check(
            summary(what).get("status") == "stopped" and os.path.exists(f"{work}/{what}/checkpoint.h5"),
            f"{what}: the run itself has a checkpoint",
        )
        check(
            summary(f"{what}/twins/x2").get("status") == "stopped" or summary(f"{what}/twins/x4").get("status") == "stopped",
            f"{what}: the twin was stopped",
        )
    finish()


if __name__ == "__main__":
    main()
