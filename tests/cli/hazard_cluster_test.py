#!/usr/bin/python3
"""kuzure job --members: the runs of a hazard as tasks of an array of Slurm or PBS (stand-ins of sbatch, srun, scontrol and qsub), in any
order, with tasks that stop and tasks that never run: the maps are the bytes of kuzure hazard on one machine."""
import os
import re
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
import harness
from harness import check, finish, program, root, scratch
from runs import Runs, check_shell

work = scratch("a hazard's jobs")  # with a blank and a quote: paths must be quoted
SCENE = """title = "heap"
dimensions = 3
[space]
spacing = 0.1
[time]
end = 0.4
[soil.sand]
density = 1850.0
young = 3.0e5
poisson = 0.3
friction_angle = 25.0
[[body]]
soil = "sand"
box = { low = [0.0, 0.0, 0.0], high = [0.6, 0.6, 0.8] }
[[wall]]
box = { low = [-1.0, -1.0, -0.3], high = [3.0, 2.0, 0.0] }
surface = { friction_angle = 20.0 }
[effects]
gravity = [0.0, 0.0, -9.81]
viscosity = { alpha = 0.1 }
[maps]
limits = [0.15, 0.4]
"""
UNCERTAIN = """[uncertain]
seed = 4
bed_friction = { low = 5.0, likely = 20.0, high = 30.0 }
[[uncertain.key]]
key = "soil.sand.cohesion"
low = 0.0
likely = 0.0
high = 200.0
"""
RUNS = ("--members", "4", "--layers", "2,4,6")
COUNT = 4 + 3


runs = Runs(work)
write, read = runs.write, runs.read


def call(*args, **how):
    return runs.call(*args, **how).stdout


env = dict(
    os.environ,
    PATH=os.path.join(work, "bin") + ":" + os.environ["PATH"],
    OMPI_MCA_rmaps_base_oversubscribe="1",
    OMPI_ALLOW_RUN_AS_ROOT="1",
    OMPI_ALLOW_RUN_AS_ROOT_CONFIRM="1",
    OMPI_MCA_hwloc_base_binding_policy="none",
    OMPI_MCA_mpi_yield_when_idle="1",
)
env.pop("OMP_NUM_THREADS", None)
# What was submitted waits in a folder, its words in the order in which they came.
SUBMIT = """#!/bin/bash
mkdir -p "$SPOOL"
id=$((700 + $(ls "$SPOOL" | grep -c 'sh$')))
cp "${@: -1}" "$SPOOL/$id.sh" && printf '%s\\n' "${@:1:$#-1}" >"$SPOOL/$id.words" && echo "$id{more}"
"""
write("bin/sbatch", SUBMIT.replace("{more}", ";cluster"), executable=True)
write("bin/qsub", SUBMIT.replace("{more}", ".server"), executable=True)
write("bin/scontrol", '#!/bin/bash\n[ "$1" = requeue ] && echo "$2" >>"$SPOOL/requeued" && kill $PPID\n', executable=True)
write("bin/srun", '#!/bin/bash\nwhile [[ $1 == --* ]]; do shift; done\nexec mpirun -n "$SLURM_NTASKS" "$@"\n', executable=True)
# With HURRY a run stops after a step or a few.
hasty = write(
    "hasty kuzure",
    f"""#!/bin/bash
args=()
while [ $# -gt 0 ]; do
    if [ "$1" = --max-minutes ] && [ -n "${{HURRY-}}" ]; then
        args+=("$1" 0.00001)
        shift 2
    else
        args+=("$1")
        shift
    fi
done
exec "{program}" "${{args[@]}}"
""",
    executable=True,
)
scene = write("it's a heap.toml", SCENE + UNCERTAIN)
for name in ("slurm", "pbs"):
    with open(os.path.join(root, f"jobs/machines/{name}.toml")) as f:
        text = re.sub(r"^cores = \d+", "cores = 2", f.read(), flags=re.M)
    write(f"{name}.toml", re.sub(r" --map-by ppr:\{per_node\}:node:PE=\{threads\}| OMP_PROC_BIND=close OMP_PLACES=cores", "", text))

call("hazard", scene, "-o", "alone", *RUNS, "--within", "1h")
want = harness.digest(os.path.join(work, "alone"), ())


def bash(script, spool, **more):
    return subprocess.run(
        ["bash", os.path.join(work, script)],
        capture_output=True,
        text=True,
        timeout=600,
        cwd=work,
        env=dict(env, SPOOL=os.path.join(work, spool), KUZURE=hasty, **more),
    )


def script_of(machine, out, ranks):
    text = call(
        "job", scene, "--machine", f"./{machine}.toml", "--nodes", "1", "--ranks-per-node", ranks, *RUNS, "-o", out, "--minutes", "6"
    )
    check_shell(write(f"{out}.sh", text), machine)
    check("{{" not in text, f"{machine}: nothing of the template is left")
    check("a task for each of 4 members" in text, f"{machine}: it says what it is for")
    return f"{out}.sh"


def slurm():
    script = script_of("slurm", "by slurm", "2")
    done = bash(script, "spool")
    check(done.returncode == 0 and f"{COUNT} runs" in done.stdout, f"Slurm: submitted {done.stdout} {done.stderr[-300:]}")
    lines = read("by slurm/runs.txt").splitlines()
    check(len(lines) == COUNT and sum("--set" in line for line in lines) == COUNT, f"a line for each run: {len(lines)}")
    check(read("spool/700.words").split() == ["--parsable", f"--array=1-{COUNT}"], "an array of all runs")
    words = read("spool/701.words").split()
    check("--dependency=afterany:700" in words and "--nodes=1" in words, f"and a job that waits for it: {words}")
    said = []
    for task, hurry in ((5, ""), (3, "yes"), (1, ""), (7, ""), (2, ""), (3, "")):  # 3 goes back into the queue; 4 and 6 never run
        done = bash(script, "spool", SLURM_JOB_ID=str(800 + task), SLURM_ARRAY_TASK_ID=str(task), SLURM_NTASKS="2", HURRY=hurry)
        said.append((task, done.returncode, done.stdout[-200:] + done.stderr[-200:]))
    check([code for _, code, _ in said] == [0, -15, 0, 0, 0, 0] and read("spool/requeued").split() == ["803"], f"tasks: {said}")
    check(all(os.path.exists(os.path.join(work, "by slurm", d, "summary.json")) for d in ("preliminary", "likely", "members/001")), "ran")
    done = bash(script, "spool", SLURM_JOB_ID="701", SLURM_NTASKS="2")
    check(
        done.returncode == 0 and done.stdout.count("there already") == 5, f"the answer takes five runs and makes two: {done.stdout[-600:]}"
    )
    check(harness.digest(os.path.join(work, "by slurm"), ()) == want, "Slurm: the bytes of every map are those of one machine")
    bash(script, "spool")
    done = bash(script, "spool", SLURM_JOB_ID="805", SLURM_ARRAY_TASK_ID="5", SLURM_NTASKS="2")
    check(done.returncode == 0 and "finished already" in done.stdout, f"started again nothing is run twice: {done.stdout[-200:]}")
    done = bash(script, "spool", SLURM_JOB_ID="703", SLURM_NTASKS="2")
    check(
        done.stdout.count("there already") == COUNT and harness.digest(os.path.join(work, "by slurm"), ()) == want, "and the answer stays"
    )
    done = bash(script, "spool", SLURM_JOB_ID="805", SLURM_ARRAY_TASK_ID=str(COUNT + 1), SLURM_NTASKS="2")
    check(done.returncode == 1 and f"no run {COUNT + 1}" in done.stderr, "a task without a run says so")


def pbs():
    script = script_of("pbs", "by pbs", "1")
    done = bash(script, "spool of pbs")
    check(done.returncode == 0 and "submitted" in done.stdout, f"PBS: submitted {done.stdout} {done.stderr[-300:]}")
    check(read("spool of pbs/700.words").split() == ["-J", f"1-{COUNT}"], "an array of all runs")
    check(read("spool of pbs/701.words").split() == ["-W", "depend=afterany:700.server"], "and a job that waits for it")
    codes = [
        bash(script, "spool of pbs", PBS_JOBID=f"700[{k}]", PBS_ARRAY_INDEX=str(k), HURRY="yes" if k == 3 else "").returncode
        for k in range(COUNT, 0, -1)
    ]
    check(codes == [0, 0, 0, 0, 5, 0, 0], f"the tasks, of which one is not done in time: {codes}")
    done = bash(script, "spool of pbs", PBS_JOBID="701")
    check(done.returncode == 0 and done.stdout.count("there already") == COUNT - 1, f"the answer goes on with it: {done.stdout[-300:]}")
    check(harness.digest(os.path.join(work, "by pbs"), ()) == want, "PBS: the bytes of every map are those of one machine")


def what_cannot_be():
    job = ("job", scene, "--nodes", "1", "--members", "4")
    call(*job, "--machine", "here", expect=2, says=["none.hazard.sh", "kuzure hazard"])
    call(*job, "--machine", "fugaku", "--account", "hp0", expect=2, says=["pjsub.hazard.sh", "slurm.hazard.sh"])
    call(*job, "--machine", "./slurm.toml", "--layers", "6,4", expect=2, says=["--layers"])
    certain = write("certain.toml", SCENE)
    call("job", certain, "--machine", "./slurm.toml", "--nodes", "1", "--members", "4", expect=2, says=["[uncertain]"])
    call("hazard", scene, "--prepare", "-o", "none", expect=2, says=["--prepare", "--layers"])
    call("hazard", scene, "--prepare", "--within", "5m", "--layers", "4", "-o", "none", expect=2, says=["--within"])
    call("hazard", certain, "--prepare", "--layers", "4", "-o", "none", expect=2, says=["[uncertain]"])
    check(not os.path.exists(os.path.join(work, "none")), "what is refused writes nothing")
    text = call("job", scene, "--machine", "./slurm.toml", "--nodes", "1", "--members", "4")
    check("--layers 4,8" in text, "without --layers: 4, and the scene's own")


slurm()
pbs()
what_cannot_be()
finish()
