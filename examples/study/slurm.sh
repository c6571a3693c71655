#!/bin/bash
# A study as a Slurm job array: `sbatch --array=1-16 examples/study/slurm.sh FOLDER_OF_SESSIONS RESULTS_FOLDER`.
# Each task measures one shard of the sessions; a task that is killed goes on where it was when it is submitted again.
# The folder of results is shared by all nodes. Afterwards: osp study merge RESULTS_FOLDER/shard-*.parquet --out all.parquet
#SBATCH --job-name=osp-study
#SBATCH --nodes=1
#SBATCH --cpus-per-task=8
#SBATCH --exclusive
#SBATCH --time=04:00:00
#SBATCH --requeue
set -euo pipefail
sessions=${1:?usage: sbatch --array=1-N slurm.sh FOLDER_OF_SESSIONS RESULTS_FOLDER}
results=${2:?usage: sbatch --array=1-N slurm.sh FOLDER_OF_SESSIONS RESULTS_FOLDER}
shard=${SLURM_ARRAY_TASK_ID:?submit it with --array=1-N}
shards=${SLURM_ARRAY_TASK_MAX:?submit it with --array=1-N}
mkdir -p "$results"
osp study "$sessions" --shard "$shard/$shards" --jobs "${SLURM_CPUS_PER_TASK:-1}" --out "$results/shard-$shard.parquet"
