#!/bin/bash
# A study in shards by HyperQueue: hyperqueue.sh FOLDER_OF_SESSIONS RESULTS_FOLDER [SHARDS]
# A server (`hq server start`) and workers (`hq worker start`, on each machine) run already and share both folders.
set -euo pipefail
sessions=$(realpath "${1:?usage: hyperqueue.sh FOLDER_OF_SESSIONS RESULTS_FOLDER [SHARDS]}")
results=${2:?usage: hyperqueue.sh FOLDER_OF_SESSIONS RESULTS_FOLDER [SHARDS]}
shards=${3:-8}
mkdir -p "$results"
results=$(realpath "$results")
# Each task gets its number in HQ_TASK_ID.
# shellcheck disable=SC2016 # the worker's shell expands it
hq submit --wait --cpus 1 --array "1-$shards" -- bash -c \
  'osp study "$0" --shard "$HQ_TASK_ID/$2" --jobs 1 --out "$1/shard-$HQ_TASK_ID-of-$2.ndjson"' "$sessions" "$results" "$shards"
osp study merge "$results"/shard-*-of-"$shards".ndjson --out "$results/all.ndjson"
