#!/usr/bin/python3
"""kuzure run --twins in legs: the coarser twins obey the clock, STOP and signals, and a restart goes on with them where they stood, until the
bits and the error bars are those of a run never stopped. Run as twins_test.py PROGRAM."""
import json
import os
import signal
import subprocess
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import block, check, failures, finish, program, scratch

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
    out, err = process.communicate(timeout=120)
    check(process.returncode == expect, f"{what}: exit {process.returncode}, expected {expect} {err[-300:]}")
    return out, err


def summary(path):
    try:
        return json.load(open(f"{work}/{path}/summary.json"))
    except FileNotFoundError:
        return {}


def wait_for(path, process):
    for _ in range(2000):
        if os.path.exists(f"{work}/{path}") or process.poll() is not None:
            return
        time.sleep(0.01)


def main():
    with open(work + "/s.toml", "w") as f:
        f.write(SCENE)
    began = time.monotonic()
    end(start("whole"), 0, "never stopped")
    eighth = (time.monotonic() - began) / 480  # min
    whole = summary("whole")
    check({"run-out", "height", "peak speed"} <= set(whole.get("error_bars", {})), "it has error bars")
    # ---- legs by the clock: each must come further than the one before
    legs, before = 0, -1
    while legs < 60 and not failures:
        legs += 1
        # Longer by and by: on a slow machine, the first ones end with their first step.
        process = start("legs", "--max-minutes", f"{eighth * 1.1**legs:.5f}")
        out, err = process.communicate(timeout=120)
        if process.returncode == 0:
            break
        check(process.returncode == 5, f"leg {legs}: exit {process.returncode} {err[-300:]}")
        done = sum(summary(d).get("time", 0) for d in ("legs/twins/x2", "legs/twins/x4", "legs"))
        check(
            done >= before and not os.path.exists(work + "/legs.old-1"),
            f"leg {legs} came to {done:.3f} s in all, the one before to {before:.3f} s",
        )
        check("checkpoint" in out and "--restart" in out, f"leg {legs} names a checkpoint")
        before = done
    check(legs > 2, f"it took {legs} legs")
    legs = summary("legs")
    check(legs.get("status") == "finished" and legs.get("state_hash") == whole["state_hash"], "in legs: the same bits")

    def told(bars):
        return {**bars, "twins": [{k: v for k, v in t.items() if k != "wall_seconds"} for t in bars["twins"]]}

    check(told(legs["error_bars"]) == told(whole["error_bars"]), "in legs: the same error bars, and the peak speed of all legs")
    for twin in ("x2", "x4"):
        check(
            summary(f"legs/twins/{twin}").get("state_hash") == summary(f"whole/twins/{twin}").get("state_hash"),
            f"in legs: the bits of twin {twin}",
        )
    # ---- STOP in the run's own directory, and a signal, while a twin runs
    for what in ("STOP", "signal"):
        process = start(what, "--set", "time.end=80")  # STOP is looked for once a second: the twins must last longer
        wait_for(f"{what}/twins/x2/history.csv", process)
        if what == "STOP":
            open(f"{work}/{what}/STOP", "w").close()
        else:
            process.send_signal(signal.SIGTERM)
        began = time.monotonic()
        end(process, 5, f"{what} while a twin runs")
        print(f"      after {time.monotonic() - began:.1f} s")
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
