#!/bin/bash
# A study in shards by GNU parallel: parallel.sh FOLDER_OF_SESSIONS RESULTS_FOLDER [SHARDS] [options of parallel]
# On several machines that share both folders: parallel.sh sessions results 32 --sshloginfile machines --workdir .
set -euo pipefail
sessions=${1:?usage: parallel.sh FOLDER_OF_SESSIONS RESULTS_FOLDER [SHARDS] [options of parallel]}
results=${2:?usage: parallel.sh FOLDER_OF_SESSIONS RESULTS_FOLDER [SHARDS] [options of parallel]}
shards=${3:-8}
mkdir -p "$results"
# One session at a time in each process: parallel starts as many as there are cores.
seq "$shards" | parallel --quote "${@:4}" \
  osp study "$sessions" --shard "{}/$shards" --jobs 1 --out "$results/shard-{}-of-$shards.ndjson"
osp study merge "$results"/shard-*-of-"$shards".ndjson --out "$results/all.ndjson"
