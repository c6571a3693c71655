#!/bin/bash
# A study by GNU parallel: find FOLDER -name '*.tilt' | parallel.sh RESULTS.ndjson [options of osp study]
# After an interruption, the same command continues. Each process measures ten sessions, because it first reads all of RESULTS.
set -euo pipefail
results=${1:?usage: find FOLDER -name '*.tilt' | parallel.sh RESULTS.ndjson [options of osp study]}
parallel --quote --max-args 10 osp study --out "$results" "${@:2}" {}
