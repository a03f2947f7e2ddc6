#!/usr/bin/env bash
# From nothing to the weights that ship in toponav/weights/compact: data, training, a DAgger
# round, training on both. Hours on two cores. Each step resumes where it was interrupted.
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

# 2. The five behaviour networks and the graph localization network.
"$toponav" train all --data "$out/cache" --preset compact --out "$out/first" \
    --threads "$workers" --seed 0

# 3. DAgger: the learner drives other offices, the expert says what it would have done.
"$toponav" collect dagger --out "$out/dagger" --weights "$out/first" --episodes 600 \
    --workers "$workers" --seed 2 --buildings offices-train
"$toponav" data prepare "$out/dagger" --preset compact --out "$out/dagger-cache" \
    --workers "$workers"

# 4. Again, on both.
"$toponav" train all --data "$out/cache" "$out/dagger-cache" --preset compact \
    --out "$out/compact" --threads "$workers" --seed 0

# 5. What ships: the six networks in half precision.
"$toponav" train release "$out/compact" --out "$out/released"
