#!/usr/bin/env bash
# usage: size.sh BUILD_DIR: what including ssdgs.h costs: seconds and bytes of code per configuration, and the seconds as a ratio to those of a
# file that never changes, compiled in the same run. Ratios are what compares from machine to machine.
out=$1/size
mkdir -p "$out"
awk 'BEGIN { print "#include <math.h>"; for (i = 0; i < 800; i++) {
    printf "double f%d(const double *x, int n) {\n    double s = 0, t = %d;\n    int i;\n", i, i
    printf "    for (i = 0; i < n; i++) s += x[i] * t > %d ? sqrt(x[i] + s) : exp(-x[i]) * t, t = t * 0.5 + x[n - 1 - i];\n    return s;\n}\n", i % 7 }
    }' >"$out/reference.c"
printf '#define SSDGS_IMPLEMENTATION\n#include "ssdgs.h"\n' >"$out/whole.c"
seconds() { # seconds COMMAND...: of the processor, the less of two
    for run in 1 2; do
        { time -p "$@"; } 2>&1 | awk '/^user|^sys/ { s += $2 } END { print s }'
    done | sort -n | head -n 1
}
for compiler in gcc clang; do
    command -v $compiler >/dev/null || continue
    base=$(seconds $compiler -O2 -c "$out/reference.c" -o "$out/object.o")
    printf '%-8s %-48s %8.2f s\n' $compiler "the file that never changes" "$base"
    for flags in "" -DSSDGS_NO_TRAINER "-DSSDGS_NO_TRAINER -DSSDGS_NO_AVX512" "-DSSDGS_NO_TRAINER -DSSDGS_NO_SIMD"; do
        rm -f "$out/object.o"
        time=$(seconds $compiler -O2 -I. $flags -c "$out/whole.c" -o "$out/object.o")
        [ -s "$out/object.o" ] || { echo "$compiler $flags: no object file" >&2; exit 1; }
        bytes=$(size "$out/object.o" | awk 'NR == 2 { print $1 }')
        echo "$time $base $bytes" | awk -v compiler=$compiler -v flags="${flags:-everything}" \
            '{ printf "%-8s %-48s %8.2f s %6.2f x %8d bytes\n", compiler, flags, $1, $1 / $2, $3 }'
    done
done
