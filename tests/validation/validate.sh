#!/bin/sh
# The validation suite with one command, from any directory: validate.sh [--quick | --slow] [--known] [--publish] [PROGRAM] [CASE...]
exec /usr/bin/python3 "$(dirname "$0")/validate.py" "$@"
