## What every job's script begins with: program, scene, results.
set -u
export TERM=dumb # plain lines in the log, no bar
program=${KUZURE:-{{program}}}
scene={{scene}}
results={{results}}
