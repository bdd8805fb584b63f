## The run itself, and what comes after each exit code. Needs the function go_on: what to do while the run is not done.

{{setup}}
{{if clocked}}

# Stop with a checkpoint before the batch system stops the job: {{limit}} s are granted, {{margin}} s kept.
left=$(({{limit}} - {{margin}} - SECONDS))
[ $left -gt 0 ] || { echo "job: setting up took all of the time" >&2; exit 1; }
{{end}}

# The steps so far, 0 before the first job: a job that gets no further must not be followed by another.
steps() { { sed -n 's/^ *"steps": *\([0-9]*\),*$/\1/p' "$results/summary.json" 2>/dev/null || true; echo 0; } | head -n 1; }
before=$(steps)
{{if launcher}}
export KUZURE_MPI=1 # ranks, whatever the launcher tells them of itself
{{end}}
{{if clocked}}
{{launch}} "$program" run "$scene" -o "$results" {{options}} --max-minutes "$(printf '%d.%02d' $((left / 60)) $((left % 60 * 100 / 60)))" --restart
{{end}}
{{if not clocked}}
{{launch}} "$program" run "$scene" -o "$results" {{options}} --restart
{{end}}
code=$?

case $code in
0)
    echo "job: done; results in $results"
    ;;
5)
    if [ -e "$results/STOP" ]; then
        echo "job: stopped by the file $results/STOP; remove it and submit the script again to go on" >&2
        exit 5
    fi
    if [ "$(steps)" = "$before" ]; then
        echo "job: no step was made in this job: it needs more time than {{limit_text}}" >&2
        exit 1
    fi
    go_on
    ;;
2) echo "job: the scene or the command line is wrong (message above); nothing to go on with" >&2 ;;
3) echo "job: the numbers failed (message above); nothing to go on with" >&2 ;;
4) echo "job: files failed (message above). Make room, then submit the script again: it goes on from the last good checkpoint" >&2 ;;
*) echo "job: kuzure or its launcher ended with $code. Submit the script again: it goes on from the last good checkpoint" >&2 ;;
esac
exit $code
