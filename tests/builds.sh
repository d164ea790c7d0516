#!/bin/sh
# usage: builds.sh BUILD_DIR COMPILER FLAGS...: every build option compiles; the library exports the interface and no more.
build=$1; shift
passed=0 failed=0
check() { if [ -z "$2" ]; then passed=$((passed + 1)); else failed=$((failed + 1)); printf 'failed: %s\n%s\n' "$1" "$2"; fi; }
# compiles NAME SOURCE WORD...: by those words, to build/option.o
compiles() {
    name=$1 source=$2; shift 2
    output=$("$@" -c "$source" -o "$build/option.o" 2>&1) && output= || output=${output:-no message}
    check "$name" "$output"
}

# Names of defined global symbols; macOS puts a _ before them, names with __ are the compiler's, test_kernels_ is kernels.h's.
exported() { nm -gP "$1" | awk '$2 ~ /^[TDBRCS]$/ { sub(/^_/, "", $1); if ($1 !~ /^(_|test_kernels_)/) print $1 }'; }

check "nm finds no function" "$(exported "$build/ssdgs.o" | grep -qx ssdgs_render || echo nothing)"
check "exported without the prefix" "$(exported "$build/ssdgs.o" | grep -v '^ssdgs_[a-z]')"
check "exported, not in compile_c.c" \
    "$(for name in $(exported "$build/ssdgs.o"); do grep -qw "$name" tests/compile_c.c || echo "$name"; done)"
# t_calls.c makes every call from within another, but for what only computes, reads or says
pure='ssdgs_(context_(create|isa|threads|fail)|error_message|.*_(string|default|exact|fast|preview|published)|model_(settings|count|arrays|peek)'
pure="$pure|camera_look_at|light_(point|directional|spot)|srgb_.*|finite|to_.*|blend_pixels|compose|stage_cpu)"
check "exported, not in t_calls.c's call_everything" \
    "$(for name in $(exported "$build/ssdgs.o" | grep -Evx "$pure"); do grep -Eq "(REFUSED|IGNORED)\($name," tests/t_calls.c || echo "$name"; done)"
check "exported with SSDGS_STATIC" "$(exported "$build/kernels.o")" # which is built with it
for option in NO_AVX2 NO_AVX512 REAL64; do compiles "SSDGS_$option" tests/library.c "$@" -DSSDGS_$option; done
windows='-Dnear= -Dfar= -DNEAR= -DFAR= -DIN= -DOUT= -DOPTIONAL= -DPLANES=14 -DERROR=0 -Dsmall=char -Dinterface=struct' # names that its headers take
compiles "Windows' names" tests/library.c "$@" -fsyntax-only $windows
# the kernels' short names are the includer's again afterwards
printf '#define R 17\n#define V 18\n#define F 19\n#define VADD 20\n#define SSDGS_IMPLEMENTATION\n#include "ssdgs.h"
extern int names[R == 17 && V == 18 && F == 19 && VADD == 20 ? 1 : -1];\n' >"$build/names.c"
compiles "an includer's macros R, V, F, VADD" "$build/names.c" "$@" -I. -fsyntax-only
for example in train relight minimal engine export view check ball unbake bench; do # each is a program of its own
    compiles "$example.c alone" examples/$example.c "$@" -I"$build" -fsyntax-only $windows
done
for header in files json images flip olat judge reduce sky splats unbake; do # each includes what it needs, and nothing of it is left over; two know nothing of ssdgs.h
    case $header in files | json) : ;; *) echo '#include "ssdgs.h"' ;; esac >"$build/header.c"
    printf '#include "examples/%s.h"\nint main(void) { return 0; }\n' "$header" >>"$build/header.c"
    compiles "$header.h alone" "$build/header.c" "$@" -I. $windows
done
compiles "without SSDGS_SCALAR" tests/library.c "$@" -USSDGS_SCALAR -USSDGS_STAGES
# renders OPTION WANTED WORD...: a program of those words, with the option, draws the wanted pictures: hashes of best and scalar kernels
renders() {
    option=$1 wanted=$2; shift 2
    output=$("$@" tests/render_only.c -o "$build/render_only" -lm -lpthread 2>&1 && "$build/render_only" || echo "exit $?")
    check "SSDGS_$option" "$([ "$output" = "$wanted" ] || echo "$output, not $wanted")"
}
"$@" -DSSDGS__IMPLEMENTED tests/render_only.c "$build/ssdgs.o" "$build/kernels.o" -o "$build/render_only" -lm -lpthread
whole=$("$build/render_only") scalar=${whole#* }
renders NO_TRAINER "$whole" "$@" -DSSDGS_NO_TRAINER
renders NO_SIMD "$scalar $scalar" "$@" -DSSDGS_NO_SIMD
for option in NO_STDIO NO_THREADS; do # nothing to the kernels, which take most of the time
    renders $option "$whole" "$@" -DSSDGS_$option -DSSDGS_SELF='"tests/kernels.h"' "$build/kernels.o"
done
rm -f "$build/option.o" "$build/render_only"
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
