#!/usr/bin/env bash
# Preset `best` in a hurry: a fifth of the drives, no DAgger rounds, fewer epochs.
# About half an hour on two cores. See docs/best.md for what it costs.
#
#   bash examples/train_quick.sh [FOLDER]      (make train-quick)
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:-runs/train-quick}
toponav=${TOPONAV:-.venv/bin/toponav}
workers=${WORKERS:-2}
threads=${THREADS:-2}

# 1. The expert drives 125 generated offices, and 20 whose rooms walls with gaps divide.
"$toponav" collect graphnav --out "$out/drives" --episodes 500 --workers "$workers" \
    --seed 1 --noise-scale 2 --episodes-per-building 4 --buildings offices-train
for seed in $(seq 30000 30019); do
    part="$out/parts/part_$seed"
    [ -f "$part/map.topo.json" ] && continue
    "$toponav" scene generate office --seed "$seed" --partitions 0.65 --out "$part"
    "$toponav" map build "$part" --out "$part/map.topo.json"
done
"$toponav" collect graphnav --out "$out/part-drives" --episodes 120 --workers "$workers" \
    --seed 51 --noise-scale 2 --any-yaw-fraction 0.05 --episodes-per-building 6 \
    --buildings "$out"/parts/*
for drives in drives part-drives; do
    "$toponav" data prepare "$out/$drives" --preset best --out "$out/$drives-cache" \
        --workers "$workers"
done

# 2. A pose network and a steering network.
"$toponav" train best --data "$out/drives-cache" "$out/part-drives-cache" --out "$out/run" \
    --epochs 6 --threads "$threads" --seed 0

# 3. The pose network learns to judge where the robot is not.
"$toponav" train judge --data "$out/drives-cache" "$out/part-drives-cache" --start "$out/run" \
    --out "$out/judge" --drives 150 --epochs 20 --learning-rate 0.002 --threads "$threads" --seed 0
"$toponav" train release "$out/judge" --out "$out/quick"
echo "evaluate it: $toponav eval graphnav --area AREA.yaml --plans PLANS.json" \
    "--agent graphnav_pf --weights $out/quick --out runs/quick-results"
