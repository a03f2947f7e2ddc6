#!/usr/bin/env bash
# Preset `best` in a hurry: a quarter of the drives, no DAgger round, half the training. Under
# three quarters of an hour on two quiet cores. See docs/best.md for what it costs.
#
#   bash examples/train_quick.sh [FOLDER]      (make train-quick)
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:-runs/train-quick}
toponav=${TOPONAV:-.venv/bin/toponav}
workers=${WORKERS:-2}
threads=${THREADS:-2}

"$toponav" collect graphnav --out "$out/drives" --episodes 600 --workers "$workers" \
    --seed 1 --noise-scale 2 --episodes-per-building 4 --buildings offices-train
"$toponav" data prepare "$out/drives" --preset best --out "$out/cache" --workers "$workers"
"$toponav" train best --data "$out/cache" --out "$out/run" --epochs 6 \
    --threads "$threads" --seed 0
"$toponav" train release "$out/run" --out "$out/quick"
echo "evaluate it: $toponav eval graphnav --area AREA.yaml --plans PLANS.json" \
    "--agent graphnav_pf --weights $out/quick --out runs/quick-results"
