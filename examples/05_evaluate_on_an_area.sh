#!/usr/bin/env bash
# Evaluates agents on published start/goal pairs of a Stanford area, the paper's test.
#
#   bash examples/05_evaluate_on_an_area.sh [AREA [EPISODES [AGENT [OUT]]]]
#
# AREA is area_1, area_3, area_5b or area_6; its files lie in $TOPONAV_DATA/graphnav_areas.
# Without EPISODES it runs all pairs that have a plan. Interrupted, it resumes.
set -euo pipefail
area=${1:-area_3}
episodes=${2:-}
agent=${3:-graphnav_pf}
out=${4:-runs/$area}
files=${TOPONAV_DATA:-../shared/data}/graphnav_areas

if [[ ! -f $files/$area.yaml ]]; then
    echo "no $files/$area.yaml: set TOPONAV_DATA to the folder that holds graphnav_areas/" >&2
    exit 1
fi

# The authors' floor plan becomes a 3-D scene, their drawing the topological map.
# The expert always runs beside the others, as the ceiling that map and protocol allow.
toponav eval graphnav --area "$files/$area.yaml" --plans "$files/${area}_plans.json" \
    --agent "$agent" ${episodes:+--episodes "$episodes"} --workers 2 --out "$out"

# The paper's tables, its numbers beside ours.
toponav tables "$out"
