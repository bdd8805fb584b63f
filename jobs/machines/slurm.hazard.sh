#!/bin/bash
## submit: bash
## Slurm: the runs of a hazard as tasks of an array, and a job after them that makes the answer.
#SBATCH --job-name={{name}}
{{if queue}}
#SBATCH --partition={{queue}}
{{end}}
#SBATCH --nodes={{nodes}}
#SBATCH --ntasks-per-node={{per_node}}
#SBATCH --cpus-per-task={{cores_per_rank}}
#SBATCH --time={{clock}}
{{if account}}
#SBATCH --account={{account}}
{{end}}
#SBATCH --requeue
#SBATCH --open-mode=append
#SBATCH {{directive}}
# {{about}}
{{include start.part.sh}}

# Started by hand on a login node (bash SCRIPT): the scenes of all runs, the array, and the job of the answer, which waits for all tasks
# however they end. Started again it goes on: what is finished stays.
if [ -z "${SLURM_JOB_ID:-}" ]; then
    "$program" hazard "$scene" -o "$results" {{hazard}} --prepare || exit
    tasks=$(wc -l <"$results/runs.txt")
    id=$(sbatch --parsable --array="1-$tasks" "$0") || exit
    id=${id%%;*}
    last=$(sbatch --parsable --nodes=1 --dependency="afterany:$id" "$0") || exit
    echo "$id submitted: $tasks runs; ${last%%;*} submitted: the answer, when they have ended"
    exit
fi
task=${SLURM_ARRAY_TASK_ID:-}

go_on() {
    echo "job: back into the queue, to go on from the checkpoint"
    scontrol requeue "$SLURM_JOB_ID" && sleep 300 # Slurm ends this script meanwhile
    echo "job: not done yet; start the script again on a login node and it goes on from the checkpoint" >&2
    exit 5
}
{{include array.part.sh}}
