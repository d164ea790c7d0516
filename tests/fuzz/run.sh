#!/bin/sh
# sh tests/fuzz/run.sh FOLDER SECONDS TARGET...: FOLDER/all is one program that takes its target from its name.
folder=$1 seconds=$2 total=0 findings=0
shift 2
for target; do
    at=$folder/$target dictionary=
    ln -sf all "$at"
    mkdir -p "$at.corpus"
    [ ! -f "tests/fuzz/$target.dict" ] || dictionary=-dict=tests/fuzz/$target.dict
    ASAN_OPTIONS=quarantine_size_mb=16 "$at" -max_total_time="$seconds" -max_len=2500 -len_control=20 -rss_limit_mb=512 -timeout=5 \
        -print_final_stats=1 -artifact_prefix="$at." $dictionary "$at.corpus" "tests/fuzz/seeds/$target" >"$at.log" 2>&1 ||
        { findings=$((findings + 1)); tail -n 40 "$at.log"; }
    n=$(sed -n 's/^stat::number_of_executed_units: *//p' "$at.log")
    echo "$target: ${n:-0} executions"
    total=$((total + ${n:-0}))
done
echo "figure fuzz_executions $total"
echo "figure fuzz_findings $findings"
[ $findings -eq 0 ]
