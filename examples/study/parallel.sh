#!/bin/bash
# A study by GNU parallel: find FOLDER -name '*.tilt' | parallel.sh RESULTS.ndjson [options of osp study]
# The same command goes on where it was stopped. Several sessions a process: each reads RESULTS before it begins.
set -euo pipefail
results=${1:?usage: find FOLDER -name '*.tilt' | parallel.sh RESULTS.ndjson [options of osp study]}
parallel --quote --max-args 10 osp study --out "$results" "${@:2}" {}
