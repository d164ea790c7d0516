#!/bin/sh
# usage: [CC=cc] sh tests/mutants.sh BUILD [first] [last]: do the tests notice wrong gradients? Each line of tests/mutants.txt changes
# a copy of ssdgs.h, or of the header that "header: " names, in one place; a mutant is caught where one of its section's tests fails.
# A line that fits nothing or does not compile is an error. Exits 0 when all are caught, after about five hours on one core. With
# "fits" for first no test runs: does every line fit?
set -u
list=tests/mutants.txt header=ssdgs.h first=${2:-1} last=${3:-99999} number=0 caught=0 total=0 errors=0 by=
mkdir -p "$1/mutants/tests" "$1/mutants/build" && work=$(cd "$1/mutants" && pwd) || exit 2
SSDGS_GOLDEN=${SSDGS_GOLDEN:-$PWD/tests/golden}
export SSDGS_GOLDEN MUTANT

cc=${CC:-cc} quick=$(command -v tcc || echo "$cc -O0") # where compiling takes longer than running
cp tests/t_*.c tests/scene.h tests/meter.h "$work/tests"
mkdir -p "$work/examples" && cp examples/*.[ch] "$work/examples" && ln -sfn "$PWD/examples/data" "$work/examples/data"
# the first failed check ends a program
sed 's/test_failed++, \(printf(.*)\);$/\1, exit(1);/' tests/test.h >"$work/tests/test.h"

# apply: $header with $MUTANT, "function: old ==> new" or "function#2: old ==> new" for the second place, as the copy's.
# A function, by its name without F(), ends where a line begins with }. A space in old stands for any white space, line ends
# included, and between an operator or a parenthesis and what follows there may be some: however the lines are broken, it fits.
parse='function parse(line,   colon, arrow, hash) {
            colon = index(line, ": "); arrow = index(line, " ==> ")
            name = substr(line, 1, colon - 1); new = substr(line, arrow + 5)
            old = pattern = substr(line, colon + 2, arrow - colon - 2)
            gsub(/[][\\.^$*+?(){}|]/, "[&]", pattern); gsub(/\[\\\]/, "\\\\", pattern); gsub(/\[\^\]/, "\\^", pattern)
            gsub(/ /, "[ \n]+", pattern); gsub(/\[\(\]/, "[(][ \n]*", pattern)
            wanted = 0
            if (hash = index(name, "#")) { wanted = substr(name, hash + 1) + 0; name = substr(name, 1, hash - 1) }
            starts = "^[A-Za-z].*[ (*]" name "\\)?\\("
            return arrow && old != new
        }
        function fits(places) { return wanted ? places >= wanted : places == 1 }
        function ends(line) { return line ~ /^}/ || line ~ /^[A-Za-z].*[;}]$/ }'
apply() {
    awk "$parse"'
        function mutate(text,   at, rest, put) {
            while (match(rest = substr(text, at + 1), pattern)) {
                put = ++places == (wanted ? wanted : 1) ? new : substr(rest, RSTART, RLENGTH)
                printf "%s%s", substr(rest, 1, RSTART - 1), put
                at += RSTART + RLENGTH - 1
            }
            printf "%s", substr(text, at + 1)
        }
        BEGIN { sound = parse(ENVIRON["MUTANT"]) }
        !inside && $0 ~ starts { inside = 1 }
        inside { body = body $0 "\n" } !inside
        ends($0) { if (inside) mutate(body); body = ""; inside = 0 }
        END { exit !(sound && fits(places)) }' "$header" >"$work/$header"
}

# Each line that fits nowhere, or in several places, as ERROR: what apply() would say of it, for all lines at once.
fit_all() {
    awk "$parse"'
        function read(header,   line, inside) {
            for (count = 0; (getline line <header) > 0;) {
                if (!inside && line ~ /^[A-Za-z].*\(/) { inside = 1; first[++count] = line; body[count] = "" }
                if (inside) body[count] = body[count] line "\n"
                if (ends(line)) inside = 0
            }
            close(header)
        }
        function places_in(text,   n) {
            for (; match(text, pattern); text = substr(text, RSTART + RLENGTH)) n++
            return n
        }
        BEGIN { read("ssdgs.h") }
        /^header: / { read(substr($0, 9)) }
        /^#/ || /^(tests|header): / || /^$/ { next }
        {
            number++; places = 0; sound = parse($0)
            for (i = 1; sound && i <= count; i++)
                if (index(first[i], name) && first[i] ~ starts) places += places_in(body[i])
            if (sound && fits(places)) next
            printf "mutant %03d ERROR : %s\n", number, $0
            errors++
        }
        END { printf "%d lines, %d of them fit nowhere or in several places\n", number, errors; exit errors > 0 }' "$list"
}

# runs NAME: builds a test of the copy, those named _64 in double, and runs it; 2 when it does not compile. Ten minutes of CPU
# time end what hangs.
runs() {
    case $1 in
        t_gradient_64) compile="$cc -O1 -DSSDGS_REAL64" ;;
        *_64) compile="$quick -DSSDGS_REAL64" ;;
        t_train | t_scene | t_fast | t_batch) compile="$cc -O1 -DSSDGS_NO_AVX2" ;;
        *) compile="$cc -O0 -DSSDGS_NO_AVX2" ;;
    esac
    nice $compile "$work/tests/${1%_64}.c" -o "$work/$1" -lm -lpthread >"$work/log" 2>&1 || return 2
    (cd "$work" && ulimit -t 600 && nice "./$1" >log 2>&1) 2>/dev/null || return 1
}

# notices TEST...: leaves the first test that fails in $by, or nothing.
notices() {
    for by in "$@"; do
        runs "$by"
        case $? in 1) return ;; 2) by=error; return ;; esac
    done
    by=
}

cp "$header" "$work/ssdgs.h"
[ "$first" != fits ] || { fit_all; exit; }
notices $(sed -n 's/^tests: //p' "$list" | tr ' ' '\n' | sort -u)
[ -z "$by" ] || { echo "$by: fails without any mutant"; cat "$work/log"; exit 2; }
while IFS= read -r MUTANT; do
    case $MUTANT in
        '#'* | '') continue ;;
        'tests: '*) tests=${MUTANT#tests: }; continue ;;
        'header: '*) cp "$header" "$work/$header"; header=${MUTANT#header: }; continue ;;
    esac
    number=$((number + 1))
    by=error
    if apply; then # every line must fit, whichever are tried
        if [ $number -lt "$first" ] || [ $number -gt "$last" ]; then continue; fi
        notices $tests
    fi
    case $by in
        '') what=SURVIVED ;;
        error) what=ERROR errors=$((errors + 1)) ;;
        *) what="caught by $by" caught=$((caught + 1)) ;;
    esac
    total=$((total + 1))
    printf 'mutant %03d %s : %s\n' $number "$what" "$MUTANT"
done <"$list"
printf 'figure mutants_caught %d\nfigure mutants_total %d\n' $caught $total
[ $errors -eq 0 ] && [ $caught -eq $total ]
