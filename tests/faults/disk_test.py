#!/usr/bin/python3
"""A disk that fills up, and one that may not be written: exit 4, the last checkpoint intact and named, and on from there with
room made. And a run that cannot fit is refused before it begins."""
import os
import resource
import shutil
import subprocess


from faults import Place, check, finish, history, program, same_results, scene_text, wait_for


def fill(disk):
    """Fills the disk to its last byte; gives the file to be removed."""
    ballast = os.path.join(disk, "ballast")
    with open(ballast, "wb", buffering=0) as f:
        try:
            while True:
                f.write(b"\0" * 65536)
        except OSError:
            pass
        try:
            while True:
                f.write(b"\0")
        except OSError:
            pass
    return ballast


def main():
    with Place("disk") as place:
        scene = place.write("scene.toml", scene_text())
        place.run(scene, "calm")

        # ---- full during a snapshot: many of them on a disk that holds a few
        # (the run knows beforehand, so it must be told to try)
        disk = place.small_disk("few", 3)
        if disk:
            often = place.write("often.toml", scene_text(every=0.0004, checkpoint=1e-6))
            place.run(often, "often")
            refused = place.run(often, "few/out", expect=2)
            check(
                "does not fit" in refused.stderr and "--force-size" in refused.stderr and "free" in refused.stderr,
                f"more snapshots than the disk holds are refused beforehand, with the numbers: {refused.stderr.strip()}",
            )
            check(not os.path.exists(place("few/out")), "the refused run wrote nothing")
            # A checkpoint is larger than a snapshot and would meet the full disk first: after the one of a stop there is none.
            place.run(often, "few/out", "--force-size", "--max-minutes", "1e-9", ranks=2, expect=5)
            full = place.run(often, "few/out", "--force-size", "--restart", "--set", "output.checkpoint_minutes=1e6", ranks=2, expect=4)
            check("full" in full.stderr and "state_" in full.stderr, "full during a snapshot: the file and the reason are named")
            check("checkpoint" in full.stderr, "full during a snapshot: the last good checkpoint is named")
            check(os.path.exists(place("few/out/checkpoint.h5")), "full during a snapshot: the checkpoint is there")
            shutil.copytree(place("few/out"), place("roomy"))
            place.run(often, "roomy", "--restart", ranks=3)
            same_results(place, "roomy", "often", "full during a snapshot, then moved to a larger disk")

        # ---- full during a checkpoint: something else takes the last byte while the run goes on
        disk = place.small_disk("shared", 24)
        # Several times: the last byte goes at any moment of the writing, and once that was inside the HDF5 library, which crashed.
        for ranks in (1, 1, 1, 1, 1, 1, 2, 2) if disk else ():
            out = f"shared/out{ranks}"
            shutil.rmtree(place(out), ignore_errors=True)
            long = place.write(f"long{ranks}.toml", scene_text(end=3.0, every=10.0, checkpoint=1e-6))
            process = place.start(long, out, ranks=ranks)
            written = wait_for(lambda: os.path.exists(place(out, "checkpoint.prev.h5")), process=process)
            check(written, "the run has written checkpoints")
            ballast = fill(disk)
            check(process.wait(300) == 4, f"full during a checkpoint, {ranks} ranks: exit {process.returncode}, expected 4")
            place.gone(place(out))
            said = open(place(f"out{ranks}.said")).read()
            check("disk is full" in said and "last good checkpoint is" in said, f"full during a checkpoint: said so: {said.strip()[-300:]}")
            os.remove(ballast)
            stopped = place.run(long, out, "--restart", "--max-minutes", "1e-9", expect=5)
            check("going on from" in stopped.stdout, "with room made the run goes on from a whole checkpoint")
            rows = [int(r.split(",")[1]) for r in history(place(out))]
            check(rows == sorted(set(rows)), f"no row is doubled after a full disk: {rows[-5:]}")

        # ---- a disk that may not be written
        disk = place.small_disk("locked", 16, ",ro")
        if disk:
            for ranks in (1, 2):
                locked = place.run(scene, "locked/out", ranks=ranks, expect=4)
                check(
                    "locked/out" in locked.stderr and "-o" in locked.stderr,
                    f"a read-only disk is named, and the remedy: {locked.stderr.strip()}",
                )
            shutil.copytree(place("calm"), place("kept"))
            locked = place.run(scene, "locked/out", f"--restart={place('kept/checkpoint.h5')}", "--set", "time.end=0.03", expect=4)
        os.mkdir(place("mine"))
        os.chmod(place("mine"), 0o555)
        if (
            os.getuid() == 0
            and subprocess.run(["setpriv", "--reuid=65534", "--clear-groups", program, "--version"], capture_output=True).returncode == 0
        ):
            os.chmod(place.path, 0o755)
            os.chmod(place("mpi"), 0o777)
            done = subprocess.run(
                ["setpriv", "--reuid=65534", "--clear-groups", *place.command(scene, "mine/out")],
                capture_output=True,
                text=True,
                env=place.environment,
                cwd="/tmp",
                timeout=60,
            )
            check(
                done.returncode == 4 and "mine/out" in done.stderr and "-o" in done.stderr,
                f"a directory of somebody else: exit {done.returncode}, {done.stderr.strip()[-200:]}",
            )

        # ---- memory: refused with the numbers, at once and with nothing written
        gigantic = place.write(
            "gigantic.toml",
            scene_text()
            .replace("high = [0.32, 0.24, 0.24]", "high = [80.0, 80.0, 80.0]")
            .replace("low = [-0.4, -0.4, -0.16], high = [1.2, 0.64, 0.0]", "low = [-0.4, -0.4, -0.16], high = [84.0, 84.0, 0.0]"),
        )
        for ranks in (1, 2):
            refused = place.run(gigantic, "gigantic", ranks=ranks, expect=2)
            check(
                "8000000000 soil" in refused.stderr and "TB of memory" in refused.stderr,
                f"8e9 particles are refused: {refused.stderr.strip()[-400:]}",
            )
            check(not os.path.exists(place("gigantic")), "nothing was written")
        checked = subprocess.run(
            [program, "check", gigantic, "--json"], capture_output=True, text=True, env=place.environment, cwd=place.path, timeout=60
        )
        check(checked.returncode == 0 and "would refuse" in checked.stdout, "kuzure check says that kuzure run would refuse")

        # ---- memory that ends in spite of all: exit 4 and no hang
        def little():
            resource.setrlimit(resource.RLIMIT_AS, (1500 << 20, 1500 << 20))

        big = place.write(
            "big.toml",
            scene_text(end=1e-3)
            .replace("high = [0.32, 0.24, 0.24]", "high = [6.4, 6.4, 6.4]")
            .replace("high = [1.2, 0.64, 0.0]", "high = [7.2, 7.2, 0.0]"),
        )
        # --force-size: on a machine with less disk or memory than its results would take it would not begin.
        done = subprocess.run(
            place.command(big, "big", "--force-size"),
            capture_output=True,
            text=True,
            env=place.environment,
            cwd=place.path,
            timeout=300,
            preexec_fn=little,
        )
        check(
            done.returncode == 4 and "no more memory" in done.stderr,
            f"memory that ends: exit {done.returncode}, {done.stderr.strip()[-300:]}",
        )
    finish()


if __name__ == "__main__":
    main()
