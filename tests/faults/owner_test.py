#!/usr/bin/python3
"""Two runs and one directory: the living owner is named and nothing of it touched; the dead one's lock is taken over. A directory that is
moved stays the one written into; a wrong -o is neither gone on in nor moved aside. And what used to end a run without a word."""
import json
import os
import re
import resource
import shutil
import signal
import socket
import subprocess

from faults import Place, check, finish, history, program, same_results, scene_text, snapshots, wait_for


def files(path):
    """Name and content of every file below a directory."""
    return {
        os.path.join(d, f): open(os.path.join(d, f), "rb").read()
        for d, _, names in os.walk(path)
        for f in names
        if not f.startswith("kuzure.lock")
    }


def main():
    with Place("owner") as place:
        short = place.write("short.toml", scene_text(end=0.002, every=0.001))
        place.run(short, "calm")
        check(not os.path.exists(place("calm/kuzure.lock")), "the lock goes with the run")

        # ---- a living owner, on one rank and on two
        long = place.write("long.toml", scene_text(end=30.0, every=10.0))
        for ranks in (1, 2):
            out = f"taken{ranks}"
            process = place.start(long, out, ranks=ranks)
            check(wait_for(lambda: os.path.exists(place(out, "history.csv")), process=process), "the owner runs")
            owner = json.load(open(place(out, "kuzure.lock")))
            for how in ((), ("--force",), ("--restart",)):
                for others in (1, 2):
                    if others == 2 and how != ("--restart",):
                        continue
                    done = place.run(long, out, *how, ranks=others, expect=2, timeout=60)
                    check(
                        f"process {owner['pid']}" in done.stderr and socket.gethostname() in done.stderr and "-o" in done.stderr,
                        f"the owner is named to {how or 'a plain start'}: {done.stderr.strip()[-250:]}",
                    )
            check(not os.path.exists(place(out + ".old-1")), "nothing is moved aside under a living owner")
            os.kill(owner["pid"], signal.SIGHUP)
            code = process.wait(300)
            check(
                code == 5 and place.summary(out)["status"] == "stopped", f"the owner went on undisturbed and stops at SIGHUP: exit {code}"
            )
            check(not os.path.exists(place(out, "kuzure.lock")), "the lock goes with a stopped run")

        # ---- a dead owner: killed, found at once; and one of another machine whose job was requeued as this one
        periodic = place.write("periodic.toml", scene_text(end=30.0, every=10.0, checkpoint=1e-6))
        process = place.start(periodic, "killed")
        check(wait_for(lambda: os.path.exists(place("killed/checkpoint.prev.h5")), process=process), "checkpoints are written")
        process.kill(), process.wait()
        check(os.path.exists(place("killed/kuzure.lock")), "a killed run leaves its lock")
        shutil.copytree(place("killed"), place("requeued"))
        place.run(periodic, "killed", "--restart", "--max-minutes", "1e-9", expect=5)
        check(not os.path.exists(place("killed/kuzure.lock")), "and the next takes it over")
        lock = json.load(open(place("requeued/kuzure.lock")))
        lock.update(boot="another machine", host="node7", job="Slurm job 9", restarts=0, directory=os.stat(place("requeued")).st_ino)
        with open(place("requeued/kuzure.lock"), "w") as f:
            json.dump(lock, f)
        place.environment.update(SLURM_JOB_ID="9", SLURM_RESTART_COUNT="1")
        place.run(periodic, "requeued", "--restart", "--max-minutes", "1e-9", expect=5, timeout=60)
        del place.environment["SLURM_JOB_ID"], place.environment["SLURM_RESTART_COUNT"]

        # ---- no result directory: a wrong -o
        os.makedirs(place("home/papers"))
        for name in ("home/thesis.tex", "home/papers/a.pdf", "home/scene.toml"):
            place.write(name, "mine")
        before = files(place("home"))
        for how in ("--restart", "--force", f"--restart={place('calm/checkpoint.h5')}"):
            done = place.run(short, "home", how, expect=2)
            check(
                "home" in done.stderr and "no result directory" in done.stderr, f"{how[:10]} with a wrong -o: {done.stderr.strip()[-250:]}"
            )
        check(files(place("home")) == before and not os.path.exists(place("home.old-1")), "the directory stays as it was")

        # ---- moved while it is written into, and another run in its old place
        # One that ends by itself might have done so before it is moved: it goes on until it has written a snapshot there, and is stopped.
        endless = place.write("endless.toml", scene_text(end=30.0, every=0.01))
        process = place.start(endless, "moving", "--force-size")
        runs = lambda: os.path.exists(place("moving/history.csv")) and len(history(place("moving"))) > 1
        check(wait_for(runs, process=process), "it runs")
        os.rename(place("moving"), place("moved"))
        there = len(snapshots(place("moved")))
        place.run(short, "moving")
        check(wait_for(lambda: len(snapshots(place("moved"))) > there, process=process), "the moved run writes where its directory is")
        process.send_signal(signal.SIGTERM)
        check(process.wait(300) == 5, f"the moved run stops when it is asked to: {process.returncode}")
        until = ["--set", f"time.end={(place.summary('moved')['steps'] + 40) * 1e-4}"]
        place.run(endless, "moved", "--restart", *until)
        place.run(endless, "middle", *until)
        same_results(place, "moved", "middle", "a run whose directory was moved")
        same_results(place, "moving", "calm", "a run in the place it had")

        # ---- links in a directory from somebody else
        for name in (
            "summary.json.tmp",
            "summary.json",
            "scene.toml.tmp",
            "checkpoint.h5.tmp",
            "history.csv.tmp",
            "timers.json",
            "report.html",
            "picture_000001.png.tmp",
        ):
            out = "links"
            shutil.rmtree(place(out), ignore_errors=True)
            shutil.copytree(place("calm"), place(out))
            place.write("precious", "precious")
            if os.path.exists(place(out, name)):
                os.remove(place(out, name))
            os.symlink(place("precious"), place(out, name))
            if name in ("summary.json.tmp", "checkpoint.h5.tmp"):
                place.run(short, out, "--restart", "--set", "time.end=0.0022")
            else:
                place.run(short, out, "--restart")
            check(open(place("precious")).read() == "precious", f"{name} as a link: what it points to stays")
        shutil.rmtree(place("links/snapshots"))
        os.mkdir(place("elsewhere"))
        os.symlink(place("elsewhere"), place("links/snapshots"))
        done = place.run(short, "links", "--restart", "--set", "time.end=0.0023", expect=4)
        check("link" in done.stderr and not os.listdir(place("elsewhere")), f"snapshots as a link: {done.stderr.strip()[-200:]}")
        shutil.rmtree(place("links"))
        shutil.copytree(place("calm"), place("links"))
        place.write("secret", "\x89PNG secret")
        os.symlink(place("secret"), place("links/picture_000000.png"))
        subprocess.run([program, "report", place("links")], capture_output=True, env=place.environment, cwd=place.path, timeout=60)
        import base64

        page = open(place("links/report.html"), errors="replace").read()
        check(base64.b64encode(open(place("secret"), "rb").read()).decode() not in page, "a linked picture is not taken into the report")

        # ---- signals before the first step
        def catches(pid, number):
            try:
                caught = re.search(r"SigCgt:\s*(\w+)", open(f"/proc/{pid}/status").read())
            except OSError:
                return False
            return bool(caught and int(caught[1], 16) >> (number - 1) & 1)

        for number in (signal.SIGUSR1, signal.SIGHUP, signal.SIGTERM):
            process = place.start(long, f"early{number}")
            check(wait_for(lambda: catches(process.pid, number), every=0.001, process=process), "signals are listened to")
            process.send_signal(number)
            code = process.wait(300)
            check(
                code == 5 and os.path.exists(place(f"early{number}/checkpoint.h5")),
                f"signal {number} during set-up: exit {code}, expected 5 and a checkpoint",
            )

        # ---- nobody reads what is said (this scene draws a warning)
        for what, redirected in (
            ("standard error full", "2>/dev/full"),
            ("standard error closed", "2>&-"),
            ("all closed", "<&- >&- 2>&-"),
            ("output full", ">/dev/full"),
            ("a pipe that is closed", "| true"),
            ("both into a closed pipe", "2>&1 | true"),
        ):
            shutil.rmtree(place("deaf"), ignore_errors=True)
            words = " ".join(place.command(short, "deaf"))
            done = subprocess.run(
                ["bash", "-c", f"set -o pipefail; {words} {redirected}"],
                env=place.environment,
                cwd=place.path,
                timeout=60,
                capture_output=True,
            )
            check(done.returncode == 0, f"{what}: exit {done.returncode}")
            same_results(place, "deaf", "calm", what)

        # ---- a limit on the size of files: exit 4 with words, and on without it
        def limited():
            resource.setrlimit(resource.RLIMIT_FSIZE, (200000, resource.RLIM_INFINITY))

        # MPI's helper process would need larger files itself.
        done = subprocess.run(
            place.command(short, "limited"),
            capture_output=True,
            text=True,
            env={**place.environment, "OMPI_MCA_ess_singleton_isolated": "1"},
            cwd=place.path,
            timeout=60,
            preexec_fn=limited,
        )
        check(
            done.returncode == 4 and "ulimit -f" in done.stderr,
            f"a limit on file sizes: exit {done.returncode}, {done.stderr.strip()[-300:]}",
        )
        place.run(short, "limited", "--restart")
        same_results(place, "limited", "calm", "a limit on file sizes, then none")
    finish()


if __name__ == "__main__":
    main()
