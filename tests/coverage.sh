#!/bin/sh
# sh tests/coverage.sh BUILD: all tests together, on the kernels up to AVX2, built by gcc for gcov: which share of the branches in
# ssdgs.h, in examples/olat.h and in its parts files.h, images.h, json.h and flip.h was taken. A branch is counted once for each
# function that it stands in: a kernel's, once per instruction set. Those never taken are listed. C++ is left out, where every call
# has a branch for exceptions.
build=$1/coverage
mkdir -p "$build"
make -j2 test BUILD="$build" CC=gcc CFLAGS='-O0 --coverage -fprofile-update=atomic -DSSDGS_NO_AVX512' LDLIBS='-lm -lpthread --coverage' \
    BUILDS= >"$build.log" 2>&1 || { tail -n 40 "$build.log"; exit 1; }
for counts in "$build"/*.gcda; do
    case $counts in */compile_cpp.gcda) continue ;; esac
    # one line of source on each: "branches": [{... "count": N, ...}, ...], "count": N, "line_number": N, ..., "function_name": "..."
    gcov -b --json-format --stdout "$counts" 2>/dev/null | sed 's/"branches": \[/\n&/g'
done | awk '
    match($0, /"function_name": "(ssdgs|olat|reduce|unbake|splats|sky|hull|judge)_[a-z0-9_]*"/) {
        name = substr($0, RSTART + 18, RLENGTH - 19)
        match($0, /"line_number": [0-9]+/)
        line = substr($0, RSTART + 15, RLENGTH - 15)
        sub(/\].*/, "")
        for (b = 0; match($0, /"count": [0-9]+/); b++) {
            key = name ":" line " branch " b
            if (!(key in taken)) order[++total] = key
            taken[key] += substr($0, RSTART + 9, RLENGTH - 9)
            $0 = substr($0, RSTART + RLENGTH)
        }
    }
    END {
        for (i = 1; i <= total; i++)
            if (taken[order[i]]) covered++
            else print "never taken: " order[i]
        printf "figure branches %d\nfigure branches_taken %d\n", total, covered
        printf "figure branch_coverage_percent %.1f\n", total ? 100 * covered / total : 0
    }'
