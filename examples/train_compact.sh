#!/usr/bin/env bash
# From nothing to the weights that ship in toponav/weights/compact: data and training, a little
# over an hour on two quiet cores. Each step resumes where it was interrupted.
#
#   bash examples/train_compact.sh [FOLDER]      (make train-compact)
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:-runs/train-compact}
toponav=${TOPONAV:-.venv/bin/toponav}
workers=${WORKERS:-2}

# 1. The expert drives 250 generated offices, eight plans in each, pushed off its path by twice
#    the paper's noise so that the networks see how to come back.
"$toponav" collect graphnav --out "$out/drives" --episodes 2000 --workers "$workers" \
    --seed 1 --noise-scale 2 --episodes-per-building 8 --buildings offices-train
"$toponav" data verify "$out/drives" --workers "$workers"
"$toponav" data prepare "$out/drives" --preset compact --out "$out/cache" --workers "$workers"

# 2. The five behaviour networks and the graph localization network, one core each.
"$toponav" train behaviors --data "$out/cache" --preset compact --out "$out/run" \
    --max-minutes 18 --threads 1 --seed 0 &
behaviors=$!
"$toponav" train localization --data "$out/cache" --preset compact --out "$out/run" \
    --max-minutes 20 --threads 1 --seed 0
wait "$behaviors"

# 3. The two baselines, PhaseNet and BehavRNN.
"$toponav" train phasenet --data "$out/cache" --preset compact --out "$out/run" \
    --max-minutes 12 --threads 1 --seed 0 &
phasenet=$!
"$toponav" train behavrnn --data "$out/cache" --preset compact --out "$out/run" \
    --max-minutes 15 --threads 1 --seed 0
wait "$phasenet"

# 4. What ships: half precision. `--weights` takes the folder.
"$toponav" train release "$out/run" --out "$out/compact"

# To go on with a DAgger round, in which the learner drives and the expert labels:
#   toponav collect dagger --out DIR --weights RUN --agent graphnav --episodes 600 --seed 2
#   toponav data prepare DIR --out CACHE2
#   toponav train all --data CACHE CACHE2 --out RUN2
