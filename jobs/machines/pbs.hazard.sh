#!/bin/bash
## submit: bash
## PBS Professional and OpenPBS: the runs of a hazard as jobs of an array, and a job after them that makes the answer.
#PBS -N {{name15}}
{{if queue}}
#PBS -q {{queue}}
{{end}}
#PBS -l select={{nodes}}:ncpus={{cores_per_node}}:mpiprocs={{per_node}}:ompthreads={{threads}}
#PBS -l walltime={{clock}}
{{if account}}
#PBS -A {{account}}
{{end}}
#PBS -j oe
#PBS -r y
#PBS {{directive}}
# {{about}}
{{include start.part.sh}}

# Started by hand on a login node (bash SCRIPT): the scenes of all runs, the array, and the job of the answer, which waits for all of them
# however they end. Started again it goes on: what is finished stays.
if [ -z "${PBS_JOBID:-}" ]; then
    "$program" hazard "$scene" -o "$results" {{hazard}} --prepare || exit
    tasks=$(wc -l <"$results/runs.txt")
    id=$(qsub -J "1-$tasks" "$0") || exit
    last=$(qsub -W depend=afterany:"$id" "$0") || exit
    echo "$id submitted: $tasks runs; $last submitted: the answer, when they have ended"
    exit
fi
task=${PBS_ARRAY_INDEX:-}

go_on() {
    echo "job: not done yet; the job of the answer goes on with it as far as its time allows, or start the script again on a login node"
    exit 5
}
{{include array.part.sh}}
