#!/bin/bash
# A study by GNU parallel: find FOLDER -name '*.tilt' | parallel.sh RESULTS.ndjson [options of osp study]
# After an interruption the same command continues. Each process reads RESULTS first, so it takes ten sessions at once.
set -euo pipefail
results=${1:?usage: find FOLDER -name '*.tilt' | parallel.sh RESULTS.ndjson [options of osp study]}
parallel --quote --max-args 10 osp study --out "$results" "${@:2}" {}
