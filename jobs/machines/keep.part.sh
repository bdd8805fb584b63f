## For jobs that submit the next one themselves.

# The batch system gives a copy of this script to the job: keep one from which the next job can be submitted.
self=$results.job.sh
mkdir -p "$(dirname "$results")"
[ "$0" -ef "$self" ] || cp "$0" "$self" || exit 4
