#!/bin/sh
# usage: builds.sh BUILD_DIR COMPILER FLAGS...: every build option compiles; multi_a.o exports the interface and no more.
build=$1; shift
passed=0 failed=0
check() { if [ -z "$2" ]; then passed=$((passed + 1)); else failed=$((failed + 1)); printf 'failed: %s\n%s\n' "$1" "$2"; fi; }

# Names of defined global symbols; macOS puts a _ before them, names with __ are the compiler's.
exported() { nm -gP "$1" | awk '$2 ~ /^[TDBRCS]$/ { sub(/^_/, "", $1); if ($1 !~ /^_/) print $1 }'; }

check "exported without the prefix" "$(exported "$build/multi_a.o" | grep -v '^ssdgs_[a-z]')"
check "exported, not in compile_c.c" \
    "$(for name in $(exported "$build/multi_a.o"); do grep -qw "$name" tests/compile_c.c || echo "$name"; done)"
for option in STATIC NO_STDIO NO_THREADS NO_TRAINER NO_SIMD NO_AVX2 NO_AVX512 REAL64; do
    output=$("$@" -DSSDGS_$option -c tests/multi_a.c -o "$build/option.o" 2>&1) && output= || output=${output:-no message}
    check "SSDGS_$option" "$output"
    [ $option != STATIC ] || check "exported with SSDGS_STATIC" "$(exported "$build/option.o")"
done
output=$("$@" -USSDGS_SCALAR -c tests/multi_a.c -o "$build/option.o" 2>&1) && output= || output=${output:-no message}
check "without SSDGS_SCALAR" "$output"
output=$("$@" -Dnear= -Dfar= -DNEAR= -DFAR= -DIN= -DOUT= -DOPTIONAL= -DPLANES=14 -DERROR=0 -Dsmall=char -Dinterface=struct \
    -c tests/multi_a.c -o "$build/option.o" 2>&1) && output= || output=${output:-no message}
check "a name that Windows' headers take" "$output"
# without the trainer the same is rendered, with half of the code
"$@" -O1 tests/render_only.c -o "$build/render_only" -lm -lpthread
"$@" -O1 -DSSDGS_NO_TRAINER tests/render_only.c -o "$build/render_only_small" -lm -lpthread
whole=$("$build/render_only") small=$("$build/render_only_small")
check "without the trainer another picture: $whole, $small" "$([ -n "$whole" ] && [ "$whole" = "$small" ] || echo differs)"
rm -f "$build/option.o"
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
