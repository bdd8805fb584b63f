#!/bin/bash
## submit: pjsub
## Fujitsu's Technical Computing Suite (pjsub): how a profile with batch = "pjsub" becomes a job's script.
{{if queue}}
#PJM -L rscgrp={{queue}}
{{end}}
#PJM -L node={{nodes}}
#PJM -L elapse={{clock}}
#PJM --mpi proc={{ranks}}
{{if account}}
#PJM -g {{account}}
{{end}}
#PJM -N {{name}}
#PJM -j
#PJM {{directive}}
# {{about}}
{{include start.part.sh}}
{{if chain}}

# Compute nodes cannot submit. Started by hand on a login node (bash SCRIPT [JOBS]), this submits a chain of step jobs, of which
# each goes on from the checkpoint of the one before; the rest is taken away once one ends with anything but 5, "not done yet".
if [ -z "${PJM_JOBID:-}" ]; then
    jobs=${1:-{{chain_jobs}}}
    said=$(pjsub --step "$0") || exit
    echo "$said"
    id=$(sed -n 's/.* Job \([0-9]*\)_[0-9]* submitted.*/\1/p' <<<"$said")
    for ((k = 1; k < jobs; k++)); do pjsub --step --sparam "jid=$id,sd=ec!=5:all" "$0" || exit; done
    exit
fi
{{include chained.part.sh}}
{{end}}
{{if not chain}}
{{include keep.part.sh}}

submit_again() { pjsub "$self"; }
{{include again.part.sh}}
{{end}}
{{include run.part.sh}}
