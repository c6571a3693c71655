#!/bin/bash
# A study as a Slurm job array: `sbatch --array=1-16 examples/study/slurm.sh FOLDER_OF_SESSIONS RESULTS_FOLDER 16`.
# Each task measures one shard of the sessions; a task that is killed goes on where it was when it is submitted again.
# The folder of results is shared by all nodes. Afterwards: osp study merge RESULTS_FOLDER/shard-*-of-16.ndjson --out all.ndjson
#SBATCH --job-name=osp-study
#SBATCH --nodes=1
#SBATCH --cpus-per-task=8
#SBATCH --exclusive
#SBATCH --time=04:00:00
#SBATCH --requeue
set -euo pipefail
sessions=${1:?usage: sbatch --array=1-N slurm.sh FOLDER_OF_SESSIONS RESULTS_FOLDER SHARDS}
results=${2:?usage: sbatch --array=1-N slurm.sh FOLDER_OF_SESSIONS RESULTS_FOLDER SHARDS}
shard=${SLURM_ARRAY_TASK_ID:?submit it with --array=1-N}
# Not the array's size: tasks that failed are submitted again as a smaller one (--array=7).
shards=${3:?usage: sbatch --array=1-N slurm.sh FOLDER_OF_SESSIONS RESULTS_FOLDER SHARDS}
mkdir -p "$results"
osp study "$sessions" --shard "$shard/$shards" --jobs "${SLURM_CPUS_PER_TASK:-1}" --out "$results/shard-$shard-of-$shards.ndjson"
