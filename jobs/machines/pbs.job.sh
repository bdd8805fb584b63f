#!/bin/bash
## submit: qsub
## PBS Professional and OpenPBS: how a profile with batch = "pbs" becomes a job's script.
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
{{if chain}}

# Compute nodes cannot submit. Started by hand on a login node (bash SCRIPT [JOBS]), this submits a chain of jobs, of which each goes on
# from the checkpoint of the one before. PBS starts the next one after any code but 0, so a job looks at what the one before it left.
ended=$results.job.ended
if [ -z "${PBS_JOBID:-}" ]; then
    jobs=${1:-{{chain_jobs}}}
    mkdir -p "$(dirname "$ended")" && rm -f "$ended" || exit 4
    id=$(qsub "$0") || exit
    echo "$id submitted"
    for ((k = 1; k < jobs; k++)); do
        id=$(qsub -W depend=afternotok:"$id" "$0") || exit
        echo "$id submitted"
    done
    exit
fi
if [ -e "$ended" ]; then
    echo "job: the job before this one ended for good (its output says why); nothing to go on with" >&2
    exit 1
fi
trap '[ $? = 5 ] || : >"$ended"' EXIT
{{include chained.part.sh}}
{{end}}
{{if not chain}}
{{include keep.part.sh}}

submit_again() { qsub "$self"; }
{{include again.part.sh}}
{{end}}
{{include run.part.sh}}
