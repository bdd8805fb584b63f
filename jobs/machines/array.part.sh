## A task of a hazard's array, or the job that makes the answer of what the tasks left. Needs `task`, the number of the run, empty for the
## answer, and the function go_on: what to do while a run is not done.

{{setup}}

# Stop with a checkpoint before the batch system stops the job: {{limit}} s are granted, {{margin}} s kept.
left=$(({{limit}} - {{margin}} - SECONDS))
[ $left -gt 0 ] || { echo "job: setting up took all of the time" >&2; exit 1; }

if [ -z "$task" ]; then
    # What the tasks finished is taken, what they did not is gone on with on this node; runs side by side must not share a core.
    unset OMP_NUM_THREADS OMP_PROC_BIND OMP_PLACES
    "$program" hazard "$scene" -o "$results" {{hazard}} --within "${left}s"
    exit
fi

# Line number `task` of what was prepared: scene, -o, directory, settings.
eval "set -- $(sed -n "${task}p" "$results/runs.txt")"
[ $# -ge 3 ] || { echo "job: no run $task in $results/runs.txt" >&2; exit 1; }
if grep -q '"status": "finished"' "$3/summary.json" 2>/dev/null; then
    echo "job: $3 is finished already"
    exit
fi
steps() { { sed -n 's/^ *"steps": *\([0-9]*\),*$/\1/p' "$1/summary.json" 2>/dev/null || true; echo 0; } | head -n 1; }
before=$(steps "$3")
{{if launcher}}
export KUZURE_MPI=1 # ranks, whatever the launcher tells them of itself
{{end}}
{{launch}} "$program" run "$@" --threads {{threads}} --quiet --max-minutes "$(printf '%d.%02d' $((left / 60)) $((left % 60 * 100 / 60)))" --restart
code=$?
if [ $code = 5 ]; then
    [ "$(steps "$3")" != "$before" ] || { echo "job: no step was made in this job: it needs more time than {{limit_text}}" >&2; exit 1; }
    go_on
fi
exit $code
