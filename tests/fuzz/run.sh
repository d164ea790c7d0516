#!/bin/sh
# sh tests/fuzz/run.sh FOLDER SECONDS TARGET...: FOLDER/all is one program that takes its target from its name. Time is the wall's:
# where a machine stood still the input tried just then seems to hang, and counts only if it does so again.
folder=$1 seconds=$2 total=0 findings=0
shift 2
for target; do
    at=$folder/$target dictionary= n=0 end=$(($(date +%s) + seconds)) left=$seconds
    ln -sf all "$at"
    mkdir -p "$at.corpus"
    [ ! -f "tests/fuzz/$target.dict" ] || dictionary=-dict=tests/fuzz/$target.dict
    while [ "$left" -gt 0 ]; do
        ASAN_OPTIONS=quarantine_size_mb=16 "$at" -max_total_time="$left" -max_len=2500 -len_control=20 -rss_limit_mb=512 -timeout=5 \
            -print_final_stats=1 -artifact_prefix="$at." $dictionary "$at.corpus" "tests/fuzz/seeds/$target" >"$at.log" 2>&1
        found=$?
        n=$((n + $(sed -n 's/^stat::number_of_executed_units: *//p' "$at.log" | grep . || echo 0)))
        left=0
        [ $found -ne 0 ] || continue
        if grep -q 'ERROR: libFuzzer: timeout' "$at.log" && "$at" -timeout=5 "$at".timeout-* >/dev/null 2>&1; then
            echo "$target: stood still at an input that takes no time: goes on"
            rm "$at".timeout-*
            left=$((end - $(date +%s)))
        else
            findings=$((findings + 1))
            tail -n 40 "$at.log"
        fi
    done
    echo "$target: $n executions"
    total=$((total + n))
done
echo "figure fuzz_executions $total"
echo "figure fuzz_findings $findings"
[ $findings -eq 0 ]
