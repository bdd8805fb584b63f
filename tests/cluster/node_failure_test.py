#!/usr/bin/python3
"""A node of two fails at random moments: its processes end, or its network does. The run, resumed by --restart, must end with the
bits of the undisturbed one. Virtual nodes (vcluster.sh), so root only; as node_failure_test.py PROGRAM FAILURES FILE.json so many
failures, and the record is written there: docs/reliability.json holds it."""
import json
import os
import random
import re
import signal
import subprocess
import sys
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "faults"))
from faults import Place, check, finish, kill, program, same_results, scene_text, wait_for
from kills import changed

CLUSTER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "vcluster.sh")
NAME = "kzf"  # a cluster of its own
os.environ["KUZURE_CLUSTER"] = NAME


def cluster(*words, **more):
    return subprocess.run(["bash", CLUSTER, *words], capture_output=True, text=True, **more)


def start(place, scene, out, each):
    """The run on two nodes, and what it says in a file."""
    environment = {k: v for k, v in place.environment.items() if k != "OMPI_MCA_btl_vader_backing_directory"}  # each node its own
    said = open(place(out + ".said"), "w")
    return subprocess.Popen(
        ["bash", CLUSTER, "run", "2", str(each), program, "run", scene, "-o", place(out), "--threads", "1", "--restart"],
        stdout=said,
        stderr=said,
        env=environment,
        cwd=place.path,
        start_new_session=True,
    )


def on_node(node):
    """Process ids of all that runs on a node. Not by "ip netns pids": it gives up where a process ends while it looks."""
    space, found = os.stat(f"/run/netns/{NAME}{node}"), []
    for entry in os.listdir("/proc"):
        try:
            if entry.isdigit() and os.path.samestat(os.stat(f"/proc/{entry}/ns/net"), space):
                found.append(int(entry))
        except OSError:
            continue
    return found


def link(node, state):
    return subprocess.run(["ip", "-n", f"{NAME}{node}", "link", "set", "eth0", state], capture_output=True).returncode == 0


def clean_up(place, process, out):
    """What a batch system does after a node failure: the job is ended everywhere, and the node comes back."""
    if process.poll() is None:
        for pid, _ in place.processes(out):
            kill(pid, signal.SIGKILL)
    process.wait(60)
    for node in (1, 2):
        wait_for(lambda: not [kill(pid, signal.SIGKILL) for pid in on_node(node)], 60, every=0.05)
        link(node, "up")
    place.gone(out)


def fail_once(place, scene, out, rng, record):
    """True if a node failed under the run; False if the run was quicker."""
    how, node, each = rng.choice(("processes", "network")), rng.choice((1, 2)), rng.choice((1, 2))
    newest, temporary = place(out, "checkpoint.h5"), place(out, "checkpoint.h5.tmp")
    had = os.path.exists(newest) or os.path.exists(place(out, "checkpoint.prev.h5"))
    begun = os.stat(newest).st_mtime_ns if os.path.exists(newest) else 0
    process = start(place, scene, out, each)
    if rng.random() < 0.2:
        time.sleep(rng.uniform(0.5, 2.0))  # MPI's start and the reading of the checkpoint among them
    else:
        wait_for(lambda: process.poll() is not None or (os.path.exists(newest) and changed(newest, begun)), 120)
        time.sleep(rng.uniform(0, 0.5))
        if rng.random() < 0.5:
            wait_for(lambda: process.poll() is not None or os.path.exists(temporary), 5, every=0.0002)
    running = process.poll() is None
    hit = link(node, "down") if how == "network" else [pid for pid in on_node(node) if kill(pid, signal.SIGKILL)]
    failed = running and bool(hit)
    check(bool(hit) or not running, f"{out}: something of node{node} is there to fail")
    writing = os.path.exists(temporary)
    # Open MPI notices that a daemon is gone; of a silent network it learns nothing, and the batch system ends the job.
    noticed = wait_for(lambda: process.poll() is not None, 30 if how == "processes" else 3)
    clean_up(place, process, out)
    with open(place(out + ".said")) as f:
        said = f.read()
    if had:
        check("no checkpoint in" not in said, f"{out}: with a checkpoint there it is never started from the beginning")
    if not failed or process.returncode == 0:
        check(process.returncode == 0, f"{out}: ends by itself only when it is finished, exit {process.returncode} {said[-300:]}")
        return False
    if how == "processes":
        check(noticed, f"{out}: mpirun ends when the processes of node{node} do")
    record["failures"] += 1
    record["by_kind"][how] += 1
    record["by_node"][f"node{node}"] += 1
    record["noticed_by_mpirun"][how] += noticed
    record["during_a_checkpoint_write"] += writing
    record["resumed_from_previous"] += len(re.findall("Going back to", said))
    return True


def campaign(failures, seed, failures_a_run=5):
    rng = random.Random(seed)
    record = {
        "seed": seed,
        "failures": 0,
        "by_kind": {"processes": 0, "network": 0},
        "by_node": {"node1": 0, "node2": 0},
        "noticed_by_mpirun": {"processes": 0, "network": 0},
        "during_a_checkpoint_write": 0,
        "resumed_from_previous": 0,
        "runs": 0,
        "runs_with_the_bits_of_the_undisturbed_one": 0,
    }
    with Place("nodes") as place:
        scene = place.write("scene.toml", scene_text(end=0.03, checkpoint=1e-6))
        place.run(place.write("calm.toml", scene_text(end=0.03)), "calm")
        record["state_hash"] = place.summary("calm")["state_hash"]
        while record["failures"] < failures:
            out, done = f"run{record['runs']}", 0
            target = min(failures_a_run, failures - record["failures"])
            while done < target:
                if fail_once(place, scene, out, rng, record):
                    done += 1
                elif os.path.exists(place(out, "summary.json")) and place.summary(out)["status"] == "finished":
                    break  # it was quicker than the failure
            record["runs"] += 1
            process = start(place, scene, out, rng.choice((1, 2)))
            check(process.wait(600) == 0, f"{out}: after {done} failures it runs to its end on both nodes")
            if same_results(place, out, "calm", f"run {record['runs']}, after {done} failures"):
                record["runs_with_the_bits_of_the_undisturbed_one"] += 1
    return record


def main():
    ready = cluster("up", "2")
    if ready.returncode != 0:
        print(f"skipped: no virtual nodes here: {ready.stderr.strip()}")
        sys.exit(77)
    try:
        wanted = int(sys.argv[2]) if len(sys.argv) > 2 else 8
        record = campaign(wanted, seed=8)
    finally:
        cluster("down")
    record["version"] = subprocess.run([program, "--version"], capture_output=True, text=True).stdout.strip()
    print(json.dumps(record, indent=1))
    check(record["failures"] == wanted, f"{record['failures']} failures of a node")
    check(record["runs_with_the_bits_of_the_undisturbed_one"] == record["runs"], "every run ended with the bits of the undisturbed one")
    if len(sys.argv) > 3:
        with open(sys.argv[3], "w") as f:
            json.dump(record, f, indent=1)
    finish()


if __name__ == "__main__":
    main()
