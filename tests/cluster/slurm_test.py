#!/usr/bin/python3
"""kuzure job in a real Slurm on two virtual nodes: a clock-limited job requeues itself until it is done, and a job whose node
dies goes on elsewhere, both with the bits of an undisturbed run. Exit 77 (not run) without root, Slurm or network namespaces."""
import glob
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import block, check, failures, finish, program, root

here = os.path.dirname(os.path.abspath(__file__))
work = tempfile.mkdtemp(prefix="kuzure slurm ")
os.environ.setdefault("KUZURE_CLUSTER", "kzs")


def cluster(*args):
    return subprocess.run(["bash", os.path.join(here, "slurm.sh"), *args], capture_output=True, text=True, timeout=120)


def slurm(*args):
    return subprocess.run(args, capture_output=True, text=True, timeout=60, cwd=work).stdout.strip()


def scene(end):
    return block(
        (0.4, 0.4, 0.4),
        ((-0.4, -0.4, -0.16), (2.4, 0.8, 0)),
        title="a block thrown across the floor",
        end=end,
        body="velocity = [2.0, 0.5, 0.0]",
        effects="viscosity = { alpha = 0.1 }",
        output="checkpoint_minutes = 0.05",
    )


def summary(out):
    try:
        with open(os.path.join(work, out, "summary.json")) as f:
            return json.load(f)
    except (OSError, ValueError):
        return {}


def log(number):
    try:
        with open(os.path.join(work, f"slurm-{number}.out")) as f:
            return f.read()
    except OSError:
        return ""


def submit(out, minutes, nodes):
    text = subprocess.run(
        [
            program,
            "job",
            "scene.toml",
            "--machine",
            "./two.toml",
            "--nodes",
            str(nodes),
            "--ranks-per-node",
            "2",
            "--minutes",
            minutes,
            "-o",
            out,
        ],
        capture_output=True,
        text=True,
        timeout=120,
        cwd=work,
    )
    check(text.returncode == 0, f"kuzure job {out} {text.stderr}")
    with open(os.path.join(work, f"{out}.sh"), "w") as f:
        f.write(text.stdout)
    said = subprocess.run(["sbatch", f"{out}.sh"], capture_output=True, text=True, timeout=60, cwd=work)
    check(said.returncode == 0, f"sbatch takes the script: {said.stdout.strip()} {said.stderr.strip()}")
    return said.stdout.split()[-1]


def wait(job, seconds, until=lambda: False):
    """Until the job has left the queue (True) or `until` holds (False)."""
    begin = time.time()
    while time.time() - begin < seconds:
        if until():
            return False
        if not slurm("squeue", "-h", "-j", job):
            return True
        time.sleep(1)
    raise TimeoutError(f"job {job}: {slurm('scontrol', 'show', 'job', job)}\n{log(job)[-2000:]}")


def main():
    up = cluster("up", "2", "2")
    if up.returncode == 77:
        print(f"NOT RUN: {up.stderr.strip()}")
        sys.exit(77)
    try:
        check(up.returncode == 0, f"Slurm is up on two virtual nodes {up.stderr}")
        os.environ["SLURM_CONF"] = up.stdout.split("SLURM_CONF=")[1].split()[0]
        for name in ("OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "OMPI_MCA_mpi_yield_when_idle"):
            os.environ[name] = "1"
        os.environ["OMPI_MCA_btl_vader_single_copy_mechanism"] = "none"
        os.environ.pop("OMP_NUM_THREADS", None)
        with open(os.path.join(root, "jobs/machines/slurm.toml")) as f:
            profile = f.read()
        # The virtual nodes: two CPUs, which all of them share, so nothing may be pinned.
        profile = (
            re.sub(r"^cores = \d+", "cores = 2", profile, flags=re.M)
            .replace("--exclusive", "--overcommit")
            .replace(" OMP_PROC_BIND=close OMP_PLACES=cores", "")
        )
        with open(os.path.join(work, "two.toml"), "w") as f:
            f.write(profile)

        # 1: the clock. 24 s a job, 8 kept: more than one job, if the run is long enough; on a machine that is too fast it is made longer.
        end = 0.05
        for trial in range(6):
            with open(os.path.join(work, "scene.toml"), "w") as f:
                f.write(scene(end))
            out = f"clocked{trial}"
            job = submit(out, "0.4", 2)
            wait(job, 900)
            if "job: back into the queue" in log(job):
                break
            end *= 3
        subprocess.run(
            [program, "run", "scene.toml", "-o", "undisturbed", "--threads", "1", "--quiet"],
            cwd=work,
            timeout=900,
            check=True,
            capture_output=True,
        )
        want = summary("undisturbed")["state_hash"]
        text = log(job)
        check(
            summary(out).get("status") == "finished",
            f"the clock-limited job ran to its end {'' if summary(out).get('status') == 'finished' else text[-2000:]}",
        )
        check(text.count("job: back into the queue") >= 1, f"it went back into the queue {text.count('job: back into the queue')} times")
        check("going on from" in text, "and on from its checkpoint")
        check(summary(out).get("ranks") == 4, f"on 4 ranks: {summary(out).get('ranks')}")
        check(summary(out).get("state_hash") == want, "state_hash as undisturbed")

        # 2: a node dies. Its daemon and every process in its namespace are killed, Slurm is told; the job comes back when it is up again.
        job = submit("dying", "30", 2)
        early = wait(job, 300, until=lambda: os.path.exists(os.path.join(work, "dying", "checkpoint.h5")))
        check(not early, "the first node failure comes while the job runs")
        space = os.stat(f"/run/netns/{os.environ['KUZURE_CLUSTER']}2").st_ino
        killed = 0
        for pid in filter(str.isdigit, os.listdir("/proc")):
            try:
                if os.stat(f"/proc/{pid}/ns/net").st_ino == space:
                    os.kill(int(pid), 9)
                    killed += 1
            except OSError:
                pass
        slurm("scontrol", "update", "nodename=node2", "state=down", "reason=killed")
        check(killed >= 2, f"node2 is dead: {killed} processes")
        wait(job, 120, until=lambda: " PD " in slurm("squeue", "-h", "-j", job))
        check("PD" in slurm("squeue", "-h", "-o", "%t", "-j", job), "Slurm has put the job back into the queue")
        # It comes back as a node that was switched on does: nothing in /tmp, and none of the killed step's PMIx in Slurm's spool,
        # over which the same step of the requeued job would trip (Slurm 22.05).
        slurm_home = os.path.dirname(os.environ["SLURM_CONF"])
        for left in glob.glob(os.path.join(slurm_home, "tmp/node2/*")) + glob.glob(os.path.join(slurm_home, "spool/node2/*pmix*")):
            shutil.rmtree(left) if os.path.isdir(left) else os.remove(left)
        subprocess.run(
            ["bash", os.path.join(here, "vcluster.sh"), "on", "2", "slurmd", "-c", "-f", os.environ["SLURM_CONF"], "-N", "node2"],
            timeout=60,
        )
        slurm("scontrol", "update", "nodename=node2", "state=resume")
        wait(job, 900)
        text = log(job)
        check(text.count("going on from") >= 1, f"it goes on from the checkpoint {'' if 'going on from' in text else text[-2000:]}")
        check(summary("dying").get("state_hash") == want, "state_hash as undisturbed")
    finally:
        if failures and "SLURM_CONF" in os.environ:
            logs = os.path.join(os.path.dirname(os.environ["SLURM_CONF"]), "log")
            shutil.copytree(logs, os.path.join(work, "slurm logs"), dirs_exist_ok=True)
        cluster("down")
        if not failures:
            shutil.rmtree(work, ignore_errors=True)
        else:
            print(f"left for inspection: {work}")
    finish()


if __name__ == "__main__":
    main()
