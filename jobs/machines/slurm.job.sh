#!/bin/bash
## submit: sbatch
## Slurm: how a profile with batch = "slurm" becomes a job's script. README of templates: docs/clusters.md.
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

go_on() {
    echo "job: back into the queue, to go on from the checkpoint"
    scontrol requeue "$SLURM_JOB_ID" && sleep 300 # Slurm ends this script meanwhile
    echo "job: not done yet; submit the script again and it goes on from the checkpoint" >&2
    exit 5
}
{{include run.part.sh}}
