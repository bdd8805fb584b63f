"""Kills at random moments, by SIGKILL or SIGTERM, with a second starter beside the run; resumed by --restart until the run ends: one owner
at any moment, and in the end the bits of the undisturbed run."""
import os
import random
import re
import signal
import subprocess
import time

from faults import Place, check, kill, same_results, scene_text, wait_for

# What is killed. "machine" is all processes at once, as when a node goes down under them.
VICTIMS = ("one rank", "mpirun", "machine", "program without mpirun")
SIGNALS = ("SIGKILL", "SIGTERM")
# How the second is started, as by a hand or a batch system that does not know of the first, and what may become of it.
AGAIN = ((), ("--force",), ("--restart",))
SECOND = ("refused: the first writes there", "refused: results are there", "took over", "killed too")


def campaign(kills, seed, kills_a_run=5):
    """A record of what was tried and what came of it."""
    rng = random.Random(seed)
    record = {
        "seed": seed,
        "kills": 0,
        "by_victim": {v: 0 for v in VICTIMS},
        "by_signal": {s: 0 for s in SIGNALS},
        "during_a_checkpoint_write": 0,
        "between_two_renames": 0,
        "before_the_first_checkpoint": 0,
        "second_starters": {s: 0 for s in SECOND},
        "second_starters_ended_beside_a_living_run": 0,
        "second_starters_that_came_first": 0,
        "second_starters_that_did_it_all_beside_a_living_process": 0,
        "runs": 0,
        "runs_with_the_bits_of_the_undisturbed_one": 0,
        "resumed_from_previous": 0,
    }
    with Place("kills") as place:
        # So short an interval that a checkpoint is written at nearly every step.
        scene = place.write("scene.toml", scene_text(end=0.03, checkpoint=1e-6))
        place.run(place.write("calm.toml", scene_text(end=0.03)), "calm")
        record["state_hash"] = place.summary("calm")["state_hash"]
        # Some kills must have fallen into a checkpoint write. How many of few do is chance, and smaller where the disk is fast and the cores
        # are slow: then a few more.
        lacking = lambda: kills >= 10 and record["during_a_checkpoint_write"] == 0 and record["kills"] < 5 * kills
        while record["kills"] < kills or lacking():
            out = f"run{record['runs']}"
            target = min(kills_a_run, max(1, kills - record["kills"]))
            done = 0
            while done < target:
                if kill_once(place, scene, out, rng, record):
                    done += 1
                elif os.path.exists(place(out, "summary.json")) and place.summary(out)["status"] == "finished":
                    break  # it was quicker than the kill
            record["runs"] += 1
            ranks = rng.choice((1, 2, 3))
            place.run(scene, out, "--restart", ranks=ranks)
            if same_results(place, out, "calm", f"run {record['runs']}, after {done} kills, ended on {ranks} ranks"):
                record["runs_with_the_bits_of_the_undisturbed_one"] += 1
        if record["runs"] and kills >= 10:
            check(record["during_a_checkpoint_write"] > 0, f"{record['during_a_checkpoint_write']} kills fell into a checkpoint write")
    return record


def kill_once(place, scene, out, rng, record):
    victim = rng.choice(VICTIMS)
    ranks = 1 if victim == "program without mpirun" else rng.choice((2, 3))
    had = os.path.exists(place(out, "checkpoint.h5")) or os.path.exists(place(out, "checkpoint.prev.h5"))
    process = place.start(scene, out, "--restart", ranks=ranks)
    temporary = place(out, "checkpoint.h5.tmp")
    if rng.random() < 0.25:
        time.sleep(rng.uniform(0.05, 1.0))  # any moment, MPI's start and the reading of the checkpoint among them
    else:
        begun = os.stat(place(out, "checkpoint.h5")).st_mtime_ns if had and os.path.exists(place(out, "checkpoint.h5")) else 0
        # From the first new checkpoint on.
        wait_for(
            lambda: process.poll() is not None
            or (os.path.exists(place(out, "checkpoint.h5")) and changed(place(out, "checkpoint.h5"), begun))
        )
        time.sleep(rng.uniform(0, 0.6))
    # A second starter beside it: refused while the first lives, its heir once it is dead.
    second = place.start(scene, out, *rng.choice(AGAIN), said=out + ".second")
    time.sleep(rng.uniform(0, rng.choice((0.15, 1.0))))
    if had and rng.random() < 0.5:
        wait_for(lambda: process.poll() is not None or os.path.exists(temporary), 5, every=0.0002)
    early, alive = second.poll(), process.poll() is None
    if early is not None and alive:
        record["second_starters_ended_beside_a_living_run"] += 1
    everyone = [(pid, is_rank) for pid, is_rank in place.processes(out) if pid != second.pid]
    chosen = [pid for pid, is_rank in everyone if is_rank or victim in ("mpirun", "machine")]
    if victim == "mpirun":
        chosen = [pid for pid, is_rank in everyone if not is_rank] or chosen
    if victim == "one rank" and chosen:
        chosen = [rng.choice(chosen)]
    number = rng.choice(SIGNALS)
    hit = [pid for pid in chosen if process.poll() is None and kill(pid, getattr(signal, number))]
    try:
        process.wait(300)
    except subprocess.TimeoutExpired:
        process.kill()
        check(False, f"{out}: it did not end within 300 s of {number} to {victim}")
    # What lies there tells where the kill fell.
    writing = os.path.exists(temporary)
    newest, previous = os.path.exists(place(out, "checkpoint.h5")), os.path.exists(place(out, "checkpoint.prev.h5"))
    lies = {
        "during_a_checkpoint_write": writing,
        "between_two_renames": writing and previous and not newest,
        "before_the_first_checkpoint": not newest and not previous,
    }
    if victim == "machine" and second.poll() is None:
        kill(second.pid, signal.SIGKILL)
    code = second.wait(300)
    with open(place(out + ".second")) as f:
        words = f.read()
    kind = {0: "took over", -signal.SIGKILL: "killed too"}.get(code)
    if code == 2:
        kind = SECOND[0] if "writes into this directory" in words else SECOND[1] if "--restart" in words else None
    if check(kind is not None, f"{out}: the second starter ends with {code}: {words.strip()[-300:]}"):
        record["second_starters"][kind] += 1
    place.gone(out)
    with open(place(out + ".said")) as f:
        said = f.read()
    if early is not None and alive:
        # A living process need not be the owner yet (mpirun is slow to start) or still (it lingers): then the second may do the whole run,
        # before the first finds nothing left to do, after it has found the same, or from new beside results moved away. Never both.
        both = stepped(said) and stepped(words) and "the old results are now in" not in words
        fine = early == 2 or early == 0 and not both
        check(fine, f"{out}: the second starter ended with {early} beside a living run: {words.strip()[-300:]}; the first: {said[-300:]}")
        record["second_starters_that_did_it_all_beside_a_living_process"] += early == 0
    if had:
        check("no checkpoint in" not in said, f"{out}: with a checkpoint there it is never started from the beginning")
    record["resumed_from_previous"] += len(re.findall("Going back to", said))
    if process.returncode == 2 and "writes into this directory" in said:
        record["second_starters_that_came_first"] += 1
        return False
    if not hit or process.returncode == 0:
        check(
            process.returncode == 0 or bool(hit), f"{out}: ends by itself only when it is finished, exit {process.returncode} {said[-300:]}"
        )
        return False
    record["kills"] += 1
    record["by_victim"][victim] += 1
    record["by_signal"][number] += 1
    for what, so in lies.items():
        record[what] += so
    return True


def stepped(said):
    """Whether a run says that it made steps."""
    made = re.search(r"^(\d+) steps in ", said, re.MULTILINE)
    return bool(made and int(made[1]))


def changed(path, since):
    try:
        return os.stat(path).st_mtime_ns != since
    except FileNotFoundError:
        return False
