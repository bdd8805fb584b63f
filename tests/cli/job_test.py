#!/usr/bin/python3
"""kuzure job: the script of every machine profile is sound shell and asks for what was wanted; what cannot be is refused; and
scripts run through a stand-in of pjsub (tests/cluster/pjsub) go on by themselves until the state is that of an undisturbed run."""
import glob
import json
import os
import re
import shutil
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
from harness import block, check, finish, program, root, scratch
from runs import Runs, check_shell

work = scratch("a job")  # with a blank: paths must be quoted


def job(*args, expect=0, says=()):
    done = subprocess.run([program, "job", *args], capture_output=True, text=True, timeout=300, cwd=work)
    good = done.returncode == expect and all(word in done.stderr for word in says) and (expect == 0 or not done.stdout)
    check(good, f"job {' '.join(args[1:])[:100]}: exit {done.returncode}, expected {expect} {'' if good else done.stderr[-400:]}")
    return done.stdout


runs = Runs(work)
write, read = runs.write, runs.read
SCENE = block(
    floor=((-0.4, -0.4, -0.16), (1.2, 0.8, 0)),
    title="a block thrown across the floor",
    end=0.01,
    body="velocity = [2.0, 0.5, 0.0]",
    effects="viscosity = { alpha = 0.1 }",
)
slurm = open(os.path.join(root, "jobs/machines/slurm.toml")).read()
# What must stand in the script of 2 nodes, by profile and mode.
WANTED = {
    ("oakforest-pacs", "flat"): [
        "#PJM -L rscgrp=regular-flat",
        "#PJM -L node=2",
        "#PJM --mpi proc=8",
        "#PJM --omp thread=16",
        "#PJM -g gz00",
        "#PJM -N hirata_52",
        'mpiexec.hydra -n 8 numactl --preferred=1 "$program"',
        "I_MPI_PIN_DOMAIN=$((256 / 4))",
        "HFI_NO_CPUAFFINITY=1",
        'pjsub "$self"',
    ],
    ("oakforest-pacs", "cache"): ["#PJM -L rscgrp=regular-cache", 'mpiexec.hydra -n 8 "$program"'],
    ("wisteria-o", ""): ["#PJM -L rscgrp=regular-o", "#PJM --mpi proc=8", "#PJM --omp thread=12", 'mpiexec -n 8 "$program"'],
    ("fugaku", ""): ["#PJM -L rscgrp=small", "#PJM -x PJM_LLIO_GFSCACHE=/vol0004", 'pjsub --step --sparam "jid=$id,sd=ec!=5:all"'],
    ("slurm", ""): [
        "#SBATCH --nodes=2",
        "#SBATCH --ntasks-per-node=2",
        "#SBATCH --cpus-per-task=24",
        "#SBATCH --requeue",
        "#SBATCH --account=gz00",
        'scontrol requeue "$SLURM_JOB_ID"',
        'srun --cpus-per-task=24 --cpu-bind=cores --wait=60 "$program"',
    ],
    ("pbs", ""): [
        "#PBS -N hirata_52",
        "#PBS -l select=2:ncpus=48:mpiprocs=2:ompthreads=24",
        "#PBS -l walltime=",
        "#PBS -A gz00",
        "#PBS -r y",
        'qsub "$self"',
        'mpirun -n 4 --map-by ppr:2:node:PE=24 "$program"',
    ],
    ("here", ""): ['mpirun -n 1 "$program"'],
}
# A site's own batch system.
BSUB = """#!/bin/bash
## not for the script
#BSUB -W {{clock}}
{{if queue}}
#BSUB -q {{queue}}
{{end}}
#BSUB {{directive}}
# {{about}}
{{include start.part.sh}}
go_on() { bresize "{{ranks}}"; }
{{include run.part.sh}}
"""
env = dict(
    os.environ,
    PATH=os.path.join(root, "tests/cluster") + ":" + os.environ["PATH"],
    OMPI_MCA_rmaps_base_oversubscribe="1",
    OMPI_ALLOW_RUN_AS_ROOT="1",
    OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
    OMPI_MCA_hwloc_base_binding_policy="none",
    OMPI_MCA_mpi_yield_when_idle="1",
)
env.pop("OMP_NUM_THREADS", None)
# Whatever the machine's speed: the first two jobs stop after a step or a few, the third has the time it was given.
HASTY = f"""#!/bin/bash
args=()
while [ $# -gt 0 ]; do
    if [ "$1" = --max-minutes ] && [[ $PJM_JOBID == *[12] ]]; then args+=("$1" 0.00001); shift 2; else args+=("$1"); shift; fi
done
exec "{program}" "${{args[@]}}"
"""
pbs_env = dict(env, PATH=os.path.join(work, "bin") + ":" + os.environ["PATH"])
large = os.path.join(root, "jobs/scenes/hirata_52.toml")
scene = os.path.join(work, "it's a block.toml")
# A stand-in of PBS: jobs wait in a folder, where run_pbs() takes them.
QSUB = f"""#!/bin/bash
spool='{work}/pbs'
mkdir -p "$spool"
depend=
[ "$1" = -W ] && depend=${{2#depend=afternotok:}} && shift 2
grep -q '^#PBS -l select=2:ncpus=1:mpiprocs=1:ompthreads=1$' "$1" || {{ echo "qsub: no such resources" >&2; exit 1; }}
id=$(($(ls "$spool" | grep -c 'sh$') + 1))
cp "$1" "$spool/$id.sh" && echo "$depend" >"$spool/$id.depend" && echo $id
"""


def granted(text):
    h, m, s = map(int, re.search(r"(?:elapse|time)=(\d+):(\d+):(\d+)", text).groups())
    return 3600 * h + 60 * m + s


def submit(machine, out, command, program, minutes="5", **more):
    text = job(
        scene,
        "--machine",
        f"./{machine}.toml",
        "--nodes",
        "2",
        "--ranks-per-node",
        "1",
        "--account",
        "gz00",
        "--minutes",
        minutes,
        "-o",
        out,
        "--set",
        "title='it''s {not} $HOME'",
    )
    write(f"{out}.sh", text)
    environment = dict(env, KUZURE=program, PJSUB_SPOOL=os.path.join(work, out + " spool"), **more)
    done = subprocess.run([*command, f"{out}.sh"], capture_output=True, text=True, timeout=300, cwd=work, env=environment)
    if "bash" in command:
        subprocess.run(["pjsub", "--run"], timeout=300, cwd=work, env=environment)
    logs = sorted(glob.glob(os.path.join(glob.escape(work), "*.o1*")), key=lambda f: int(f.rsplit(".o", 1)[1]))
    said = [open(f).read() for f in logs]
    codes = [open(f).read().split()[0][3:] for f in sorted(glob.glob(os.path.join(glob.escape(work), "*.stats")))]
    for f in glob.glob(os.path.join(glob.escape(work), "*.o1*")) + glob.glob(os.path.join(glob.escape(work), "*.stats")):
        os.remove(f)
    return done, codes, said


def summary(out):
    return json.loads(read(os.path.join(out, "summary.json")) or "{}")


def run_pbs(machine, out, command, program):
    shutil.rmtree(os.path.join(work, "pbs"), ignore_errors=True)
    write(f"{out}.sh", job(scene, "--machine", f"./{machine}.toml", "--nodes", "2", "--ranks-per-node", "1", "--minutes", "5", "-o", out))
    started = subprocess.run([*command, f"{out}.sh"], capture_output=True, text=True, timeout=300, cwd=work, env=pbs_env)
    check(started.returncode == 0, f"{out}: submitted {started.stdout} {started.stderr}")
    codes, said, k = {}, "", 1
    while os.path.exists(os.path.join(work, f"pbs/{k}.sh")):
        before = read(f"pbs/{k}.depend").strip()
        if not before or codes.get(before, "0") != "0":  # afternotok; else PBS takes the job away
            done = subprocess.run(
                ["bash", os.path.join(work, f"pbs/{k}.sh")],
                capture_output=True,
                text=True,
                timeout=300,
                cwd=work,
                env=dict(pbs_env, PBS_JOBID=str(k), KUZURE=program),
            )
            codes[str(k)], said = str(done.returncode), said + done.stdout + done.stderr
        k += 1
    return list(codes.values()), said


def every_profile():
    profiles = sorted(os.path.basename(f)[:-5] for f in glob.glob(os.path.join(root, "jobs/machines/*.toml")))
    check(set(profiles) == {name for name, _ in WANTED}, f"every profile is tested: {profiles}")
    for (name, mode), wanted in WANTED.items():
        nodes = "1" if name == "here" else "2"
        text = job(
            large, "--machine", name, "--nodes", nodes, "--account", "gz00", "--set", "title='it''s'", *(["--mode", mode] if mode else [])
        )
        missing = [line for line in wanted if line not in text]
        check(not missing, f"{name} {mode}: the script asks for what was wanted {missing}")
        script = write(f"{name}{mode}.sh", text)
        check_shell(script, f"{name} {mode}")
        options = re.search(r"\n(?!#)", text)  # batch systems read options up to the first command
        check(not re.search(r"^#(PJM|SBATCH|PBS)", text[options.start() :], re.M), f"{name} {mode}: options come before commands")
        if name != "here":
            check(
                re.search(r"elapse=\d\d:\d\d:\d\d|walltime=\d\d:\d\d:\d\d|--time=\d\d:\d\d:\d\d", text) is not None,
                f"{name} {mode}: a clock limit",
            )

    check(
        {f[:-7] for f in os.listdir(os.path.join(root, "jobs/machines")) if f.endswith(".job.sh")} == {"none", "pbs", "pjsub", "slurm"},
        "every template is tested by a profile",
    )


def clock_limits():
    # The elapse time follows the prediction, up to the queue's limit; then jobs follow one another.
    short, long = (granted(job(large, "--machine", "slurm", "--nodes", "1", "--set", f"time.end={end}")) for end in (1, 5000))
    check(600 < short < long == 24 * 3600, f"clock limits of a short and a long run: {short}, {long} s")
    check("about" in job(large, "--machine", "slurm", "--nodes", "1", "--set", "time.end=20000"), "a run of several jobs says so")
    check(granted(job(large, "--machine", "fugaku", "--nodes", "2", "--minutes", "90")) == 5400, "--minutes is taken as it is")


def what_cannot_be():
    job(large, "--machine", "oakforest-pacs", "--nodes", "9000", expect=2, says=["8208 nodes"])
    job(large, "--machine", "oakforest-pacs", "--nodes", "4000", expect=2, says=["regular-flat (nodes 1 to 2048"])
    job(large, "--machine", "slurm", "--nodes", "1", "--minutes", "9999", expect=2, says=["--minutes 9999", "1440 minutes"])
    job(large, "--machine", "oakforest-pacs", "--nodes", "1", "--mode", "flta", expect=2, says=['did you mean "flat"', "flat, cache"])
    job(large, "--machine", "oakforest-pacs", "--nodes", "1", "--mode", "flat", "--queue", "debug-cache", expect=2, says=["for mode cache"])
    job(large, "--machine", "slurm", "--nodes", "1", "--mode", "flat", expect=2, says=["--mode flat", "no such thing"])
    job(large, "--machine", "slurm", "--nodes", "1", "--ranks-per-node", "100", expect=2, says=["48 cores"])
    job(large, "--machine", "oakforest", "--nodes", "1", expect=2, says=['did you mean "oakforest-pacs"', "wisteria-o"])
    job(large, "--machine", "./nothing.toml", "--nodes", "1", expect=2, says=["nothing.toml", "machine profile"])
    job(
        large,
        "--machine",
        "wisteria-o",
        "--nodes",
        "1",
        "--force-step",
        "--set",
        "space.spacing=0.005",
        expect=2,
        says=["Remedy: at least", "nodes, or a larger space.spacing"],
    )
    for old, new, says in [
        ("cores = 48", "coers = 48", ['node.coers: expected a known key, found "coers"; did you mean "cores"']),
        ("cores = 48", "cores = 0", ["node.cores: expected an integer"]),
        ('"slurm"', '"slrum"', ["batch: expected one of none, pbs, pjsub, slurm", 'did you mean "slurm"', "slrum.job.sh"]),
        ('"srun ', '"srun -n {rank} ', ["launch.command", "found {rank}"]),
        ("[queue.default]", '[queue.default]\nmode = "flat"', ["queue.default.mode", "[mode.flat]"]),
        ("latency = 1.5e-6", "latency = -1", ["cost.latency: expected a number in s, x > 0, found -1"]),
    ]:
        assert old in slurm
        text = slurm.replace(old, new)
        bad = write("bad.toml", text)
        line = 1 + next(k for k, (a, b) in enumerate(zip(text.split("\n"), slurm.split("\n"))) if a != b)
        job(large, "--machine", bad, "--nodes", "1", expect=2, says=[f"bad.toml:{line}: " if "mode" not in new else "bad.toml:", *says])


def own_batch_system():
    """A template beside a profile, and what may be wrong in one."""
    write("site.toml", slurm.replace('"slurm"', '"bsub"').replace("[launch]", "[launch]\n").replace('["--exclusive"]', '["# ours", "-x"]'))
    write("bsub.job.sh", BSUB)
    write("#BSUB -evil.toml", SCENE)
    text = job(
        "#BSUB -evil.toml", "--machine", "./site.toml", "--nodes", "1", "--account", "gz00", "--set", "title='it''s'", "-o", "$(touch out)`"
    )
    options = text[: re.search(r"\n(?!#)", text).start()].split("\n")
    check(
        [o for o in options if o.startswith("#BSUB")] == [o for o in options if o.startswith("#BSUB -W ") or o == "#BSUB -x"]
        and "# ours" in options,
        f"a template beside the profile is filled, and a scene's name gives no option {options}",
    )
    check(
        "not for the script" not in text and "{{" not in text and 'bresize "2"' in text,
        "its own comments go, placeholders are filled everywhere",
    )
    check(
        subprocess.run(["bash", "-n", write("site.sh", text)]).returncode == 0 and "'/" in text and "$(touch out)`'" in text,
        "as sound shell, users' words quoted",
    )
    for old, new, line, says in [
        ("{{clock}}", "{{clok}}", 3, ['{{clok}}: expected a placeholder, found none of this name; did you mean "clock"', "Known: "]),
        ("{{clock}}", "{{clock}", 3, ["expected }} after {{"]),
        ("{{if queue}}", "{{if queues}}", 4, ["{{queues}}", 'did you mean "queue"']),
        ("{{end}}", "", 4, ["{{if}}: expected {{end}}"]),
        ("{{if queue}}", "", 6, ["{{end}}: expected {{if NAME}}"]),
        ("start.part", "strat.part", 9, ["{{include strat.part.sh}}", "found none of this name"]),
        ("start.part.sh", "../start.part.sh", 9, ["found none of this name"]),
        ("start.part.sh", "bsub.job.sh", 9, ["includes itself"]),
        ('"{{ranks}}"', '"{{results}}"', 10, ["{{results}}: expected it outside quotes"]),
        ("{{clock}}", "{{directive}} {{about}}", 3, ["{{about}}: expected one list on a line"]),
    ]:
        assert old in BSUB
        write("bsub.job.sh", BSUB.replace(old, new, 1))
        job(scene, "--machine", "./site.toml", "--nodes", "1", expect=2, says=[f"bsub.job.sh:{line}: ", *says])


def jobs_go_on(want, hasty):
    done, codes, said = submit("oakforest-pacs", "resubmits", ["pjsub"], hasty)
    check(done.returncode == 0, f"pjsub takes the Oakforest-PACS script {done.stdout} {done.stderr}")
    check(codes == ["5", "5", "0"], f"jobs go on by themselves until done: codes {codes} {'' if codes else said}")
    check(summary("resubmits").get("state_hash") == want, "and end with the undisturbed state_hash")
    check(all("submitting the next job" in s for s in said[:-1]) and said and "job: done" in said[-1], "their output says so")

    done, codes, said = submit("fugaku", "chained", ["bash"], hasty, PJSUB_ALLOW="login")
    check(done.stdout.count("submitted") == 2, f"Fugaku's script, started by hand, submits a chain {done.stdout} {done.stderr}")
    check(codes == ["5", "5"] and "submit the script again" in said[-1], f"the chain was too short and says so: {codes}")
    done, codes, said = submit("fugaku", "chained", ["bash"], hasty, PJSUB_ALLOW="login")
    check(codes == ["0"], f"submitted again it goes on, and what is left of the chain is taken away: {codes}")
    check(summary("chained").get("state_hash") == want, "and the chain ends with the undisturbed state_hash")


def pbs_goes_on(want):
    """By a stand-in of qsub: the queue is run here, each job after the one it depends on."""
    write("bin/qsub", QSUB, executable=True)
    profile = (
        re.sub(r"^cores = \d+", "cores = 1", open(os.path.join(root, "jobs/machines/pbs.toml")).read(), flags=re.M)
        .replace(" --map-by ppr:{per_node}:node:PE={threads}", "")
        .replace(" OMP_PROC_BIND=close OMP_PLACES=cores", "")
    )
    write("pbs.toml", profile)
    write("pbs-chain.toml", profile.replace('batch = "pbs"', 'batch = "pbs"\nresubmit = "chain"'))
    first_stops = write("first stops", HASTY.replace("$PJM_JOBID == *[12]", "$PBS_JOBID == 1"), executable=True)

    codes, said = run_pbs("pbs", "pbs itself", ["qsub"], first_stops)
    check(
        codes == ["5", "0"] and summary("pbs itself").get("state_hash") == want,
        f"PBS: jobs go on by themselves to the undisturbed state_hash: {codes} {said[-300:]}",
    )
    codes, said = run_pbs("pbs-chain", "pbs chain", ["bash"], first_stops)
    check(
        codes == ["5", "0"] and summary("pbs chain").get("state_hash") == want,
        f"PBS: a chain goes on to the undisturbed state_hash: {codes} {said[-300:]}",
    )
    codes, said = run_pbs("pbs-chain", "pbs fails", ["bash"], write("ends with three", "#!/bin/bash\nexit 3\n", executable=True))
    check(codes == ["3", "1"] and "ended for good" in said, f"PBS: a chain that failed for good runs nothing more: {codes}")


def endings_that_stop():
    """A program that only ends."""
    for code, words in [
        (2, "nothing to go on with"),
        (3, "numbers failed"),
        (4, "Make room"),
        (77, "ended with 77"),
        (5, "no step was made"),
    ]:
        stub = write(f"ends with {code}", f"#!/bin/bash\nexit {code}\n", executable=True)
        done, codes, said = submit("fugaku", f"stub{code}", ["bash"], stub)
        expected = [str(code if code != 5 else 1)]
        check(
            codes == expected and words in "".join(said),
            f"kuzure ends with {code}: one job, {codes}, and it says why {'' if codes == expected else said}",
        )
    stopped = write("stopped by hand", '#!/bin/bash\nmkdir -p "$4"\ntouch "$4/STOP"\nexit 5\n', executable=True)
    done, codes, said = submit("oakforest-pacs", "stopped", ["pjsub"], stopped)
    check(codes == ["5"] and "stopped by the file" in "".join(said), f"a STOP file ends the series: {codes}")


def main():
    write(scene, SCENE)
    every_profile()
    clock_limits()
    what_cannot_be()
    own_batch_system()
    hasty = write("hasty kuzure", HASTY, executable=True)
    for name in ("oakforest-pacs", "fugaku"):
        text = open(os.path.join(root, f"jobs/machines/{name}.toml")).read()
        write(f"{name}.toml", re.sub(r"^cores = \d+", "cores = 1", text, flags=re.M))
    subprocess.run([program, "run", scene, "-o", "undisturbed", "--threads", "1", "--quiet"], cwd=work, timeout=300, env=env)
    want = summary("undisturbed").get("state_hash")
    check(want is not None, "an undisturbed run")
    jobs_go_on(want, hasty)
    pbs_goes_on(want)
    endings_that_stop()
    finish()


if __name__ == "__main__":
    main()
