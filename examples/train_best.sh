#!/usr/bin/env bash
# From nothing to preset `best`: about three hours on two quiet cores. Each step resumes
# where it was interrupted. See docs/best.md.
#
#   bash examples/train_best.sh [FOLDER]      (make train-best)
set -euo pipefail
cd "$(dirname "$0")/.."
out=${1:-runs/train-best}
toponav=${TOPONAV:-.venv/bin/toponav}
workers=${WORKERS:-2}
threads=${THREADS:-2}

# 1. The expert drives 250 generated offices, eight plans in each, pushed off its path by twice
#    the paper's noise.
"$toponav" collect graphnav --out "$out/drives" --episodes 2000 --workers "$workers" \
    --seed 1 --noise-scale 2 --episodes-per-building 8 --buildings offices-train
"$toponav" data prepare "$out/drives" --preset best --out "$out/cache" --workers "$workers"

# 2. A first pose network and a first steering network.
"$toponav" train best --data "$out/cache" --out "$out/first" --threads "$threads" --seed 0

# 3. They drive 500 plans in 125 offices; the expert says what it would have done there.
"$toponav" collect dagger --out "$out/round1" --weights "$out/first" --agent graphnav_pf \
    --expert-share 0.25 --episodes 500 --workers "$workers" --seed 11 \
    --any-yaw-fraction 0.05 --episodes-per-building 4 --buildings offices-train
"$toponav" data prepare "$out/round1" --preset best --out "$out/cache1" --workers "$workers"

# 4. Both again on all drives.
"$toponav" train best --data "$out/cache" "$out/cache1" --out "$out/run" \
    --threads "$threads" --seed 0

# 5. Rooms that walls with gaps divide, and the pose network learns to judge where the robot is not.
for seed in $(seq 30000 30069); do
    part="$out/parts/part_$seed"
    [ -f "$part/map.topo.json" ] && continue
    "$toponav" scene generate office --seed "$seed" --partitions 0.65 --out "$part"
    "$toponav" map build "$part" --out "$part/map.topo.json"
done
"$toponav" collect graphnav --out "$out/part-drives" --episodes 560 --workers "$workers" \
    --seed 51 --noise-scale 2 --any-yaw-fraction 0.05 --episodes-per-building 8 \
    --buildings "$out"/parts/*
"$toponav" data prepare "$out/part-drives" --preset best --out "$out/part-cache" --workers "$workers"
"$toponav" train judge --data "$out/cache" "$out/cache1" "$out/part-cache" --start "$out/run" \
    --out "$out/judge" --threads "$threads" --seed 0

# 6. The robot itself drives there, and gets lost; it learns to judge from that as well.
"$toponav" collect dagger --out "$out/part-round1" --weights "$out/judge" --agent graphnav_pf \
    --expert-share 0.1 --episodes 350 --workers "$workers" --seed 71 \
    --any-yaw-fraction 0.02 --episodes-per-building 5 --buildings "$out"/parts/*
"$toponav" data prepare "$out/part-round1" --preset best --out "$out/part-cache1" --workers "$workers"
"$toponav" train judge --data "$out/cache" "$out/cache1" "$out/part-cache" "$out/part-cache1" \
    --start "$out/judge" --out "$out/judge1" --drives 350 --epochs 32 --learning-rate 0.002 \
    --threads "$threads" --seed 0

# 7. What ships: half precision.
"$toponav" train release "$out/judge1" --out "$out/best"
