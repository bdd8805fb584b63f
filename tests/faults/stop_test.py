#!/usr/bin/python3
"""Runs that are asked to stop: exit 5 on all ranks with a checkpoint, and on from there to the bits of the undisturbed run."""
import json
import os
import signal

from faults import Place, check, finish, history, legs, same_results, scene_text, wait_for


def main():
    with Place("stop") as place:
        long = place.write("long.toml", scene_text(end=30.0, every=0.01))

        def stopped(name, ask, *more, ranks=1, expect=(5,)):
            """Starts, asks to stop once it runs, and goes on to 40 steps after the stop."""
            out = name.replace(" ", "-").replace("/", "-")
            # --force-size: of all that its 300,000 steps would write it writes little, so a disk with little room will do.
            process = place.start(long, out, "--force-size", *more, ranks=ranks)
            runs = lambda: os.path.exists(place(out, "history.csv")) and len(history(place(out))) > 1
            check(wait_for(runs, process=process), f"{name}: it runs")
            ask(process, out)
            try:
                code = process.wait(300)
            except Exception:
                code = "none within 300 s"
            check(code in expect, f"{name}: exit {code}, expected {expect}")
            check(place.gone(out, 200), f"{name}: no process is left")
            return out

        def resumed(name, out, ranks, step):
            """Both runs end on the same step: the one stopped and one that was never disturbed."""
            until = ["--set", f"time.end={(step + 40) * 1e-4}"]
            place.run(long, out, "--restart", *until, ranks=ranks)
            place.run(long, out + "-calm", *until)
            same_results(place, out, out + "-calm", name)

        def put_file(_, out):
            open(place(out, "STOP"), "w").close()

        for name, ranks, on, ask in (
            ("SIGUSR1", 1, 2, lambda p, _: p.send_signal(signal.SIGUSR1)),
            ("SIGUSR1 to mpirun", 2, 1, lambda p, _: p.send_signal(signal.SIGUSR1)),
            ("SIGTERM", 1, 1, lambda p, _: p.send_signal(signal.SIGTERM)),
            ("SIGINT", 1, 3, lambda p, _: p.send_signal(signal.SIGINT)),
            ("a file STOP", 1, 2, put_file),
            ("a file STOP on 3 ranks", 3, 2, put_file),
        ):
            out = stopped(name, ask, ranks=ranks)
            summary = place.summary(out)
            check(
                summary["status"] == "stopped" and summary["exit_code"] == 5 and os.path.exists(place(out, "checkpoint.h5")),
                f"{name}: summary.json and checkpoint.h5 tell of the stop",
            )
            check("checkpoint.h5" in open(place(out + ".said")).read(), f"{name}: the checkpoint is named")
            resumed(name, out, on, summary["steps"])
            check(not os.path.exists(place(out, "STOP")), f"{name}: nothing stops the next run")

        # One rank alone hears a signal: all stop together.
        def one_rank(_, out):
            os.kill([pid for pid, is_rank in place.processes(out) if is_rank][-1], signal.SIGUSR1)

        out = stopped("SIGUSR1 to one rank of two", one_rank, ranks=2)
        check(place.summary(out)["status"] == "stopped", "SIGUSR1 to one rank: all ranks stopped")

        # mpirun turns SIGTERM into a kill: the last periodic checkpoint stands.
        periodic = place.write("periodic.toml", scene_text(end=30.0, every=0.01, checkpoint=1e-6))
        process = place.start(periodic, "term", "--force-size", ranks=2)
        written = wait_for(lambda: os.path.exists(place("term", "checkpoint.prev.h5")), process=process)
        check(written, "SIGTERM to mpirun: checkpoints are written")
        process.send_signal(signal.SIGTERM)
        check(process.wait(300) != 0, f"SIGTERM to mpirun: exit {process.returncode}")
        place.gone("term")
        step = int(history(place("term"))[-1].split(",")[1])
        resumed("SIGTERM to mpirun", "term", 2, step + 20)

        # --max-minutes, and a job that a batch system starts again and again by the same line until it is done.
        whole = place.write("whole.toml", scene_text(end=0.03))
        place.run(whole, "calm")
        codes = []
        steps = [0]
        for minutes in legs(place.summary("calm")["wall_seconds"]):
            done = place.run(whole, "requeued", "--restart", "--max-minutes", minutes, ranks=1 + len(codes) % 2, expect=(0, 5))
            codes.append(done.returncode)
            # However slow the machine: every start gets further.
            steps.append(json.load(open(place("requeued", "summary.json")))["steps"])
            if not check(steps[-1] > steps[-2], f"start {len(codes)} goes on from step {steps[-2]} to {steps[-1]}"):
                break
            if codes[-1] != 5:
                break
        check(codes[-1] == 0 and codes[:-1] == [5] * (len(codes) - 1) and len(codes) > 1, f"a requeued job comes to its end: exits {codes}")
        same_results(place, "requeued", "calm", f"a job requeued {len(codes) - 1} times")
    finish()


if __name__ == "__main__":
    main()
