#!/usr/bin/env bash
# Preset debug: a program that divides by zero, makes a number that is none, or one beyond all, is stopped by SIGFPE, in threads too; one
# that does not is left alone.
#   trap_test.sh PROGRAM DIVIDES_BY_ZERO.so
set -euo pipefail
program=$1 defects=$2
status=0
# MPI, whose end the defects replace, is started by `run` alone; a scene that is not there is as good as one.
run() { KUZURE_MPI=1 KUZURE_TEST_DEFECT=$1 LD_PRELOAD=$defects "$program" run nowhere.toml >/dev/null 2>&1; }
code=0
run none || code=$?
[ $code = 2 ] || { echo "without a defect it ends with $code" >&2; status=1; }
for defect in division invalid overflow thread; do
    code=0
    run $defect || code=$?
    [ $code = $((128 + 8)) ] || { echo "$defect: expected the end by SIGFPE (136), found $code" >&2; status=1; }
done
exit $status
