#!/bin/sh
# sh tests/figures.sh BUILD FUZZ_SECONDS FUZZ_TARGET...: runs the tests at their longest and writes BUILD/figures/FIGURES.md and
# BUILD/figures.json from what they print ("figure KEY VALUE", "row ROW,ROW passed|failed NAME"). Hours; a part whose log is there
# already is not repeated: delete it to have it again. With - for FUZZ_SECONDS nothing is run: what has no log stays as
# tests/FIGURES.md has it, with the commit it was measured at. What the machine lacks (clang's libFuzzer, gcov) is left out and named.
set -u
build=$1 seconds=$2
shift 2
targets="$*" out=$build/figures
mkdir -p "$out"

# part NAME TITLE COMMAND...: the log is there once the command has ended
part() {
    name=$1 title=$2 log=$out/$1.log
    shift 2
    if [ ! -f "$log" ] && [ "$seconds" = - ]; then
        awk -v head="## $title" '/^## / { in_it = $0 == head } in_it { section[++n] = $0 }
            END {
                while (n && section[n] == "") n--
                if (!n) section[n = 1] = head "\n\nNot measured yet."
                print ""
                for (i = 1; i <= n; i++) print section[i]
            }' tests/FIGURES.md
        return
    fi
    if [ ! -f "$log" ]; then
        echo "$name: $*" >&2
        printf 'commit %s\ncommand %s\n' "$(git rev-parse --short HEAD 2>/dev/null || echo unknown)" "$*" >"$log.part"
        "$@" >>"$log.part" 2>&1
        echo "exit $?" >>"$log.part"
        mv "$log.part" "$log"
    fi
    printf '\n## %s\n\n`%s`\n' "$title" "$(sed -n 's/^command //p' "$log" | sed 1q)"
    # rows of the catalogue, then figures
    awk '
        /^row [0-9,]+ (passed|failed) / {
            if (said[$0]++) next # a test that runs with two settings
            if (!rows++) printf "\n| row | | |\n| --- | --- | --- |\n"
            what = $0; sub(/^row [0-9,]+ [a-z]+ /, "", what)
            gsub(/,/, ", ", $2)
            printf "| %s | %s | %s |\n", $2, what, $3
        }
        /^figure / { key[++n] = $2; value[n] = $3 }
        /^hash / { hash[++m] = $0 }
        /^[0-9]+ passed, [0-9]+ failed$/ { last = $0 }
        /: ([0-9]+ passed, [0-9]+ failed|absent.*|no result.*)$/ { line[++k] = $0 }
        /^never taken: / { split($3, at, ":"); if (at[1] != name) line[++k] = name = at[1]; line[k] = line[k] " " at[2] }
        /^commit / { commit = $2 }
        /^exit / { code = $2 }
        END {
            if (n) printf "\n| figure | |\n| --- | --- |\n"
            for (i = 1; i <= n; i++) printf "| %s | %s |\n", key[i], value[i]
            if (m) printf "\n"
            for (i = 1; i <= m; i++) printf "    %s\n", hash[i]
            if (k) printf "\n"
            for (i = 1; i <= k; i++) printf "- %s\n", line[i]
            printf "\nAt commit %s%s.\n", commit, last ? ": " last : ""
            if (code != 0) printf "\nEnded with exit status %s.\n", code
        }' "$log"
}

absent() { printf '\n## %s\n\nNot measured: %s is missing.\n' "$1" "$2"; }

cpu=$(sed -n 's/^model name[[:space:]]*: //p' /proc/cpuinfo 2>/dev/null | sed 1q)
{
    part golden 'Golden values and gradients, float' "$build/t_golden"
    part golden_64 'The same sources in double' "$build/t_golden_64"
    part accuracy 'Elementary functions' "$build/t_accuracy" full
    part shading 'encoding, dipole, ASG, Fresnel' "$build/t_accuracy" shading
    part brute 'Both passes against brute force' "$build/t_brute" full
    part gradient 'The whole backward pass against central differences, in double' "$build/t_gradient"
    part stress 'Stress: geometry, rasteriser, light, shading' "$build/t_stress"
    part soak 'Stress: training, determinism' "$build/t_soak" full
    part scene 'Stress: placed models' "$build/t_scene"
    part light 'Lights' "$build/t_light"
    part material 'Materials' "$build/t_material"
    part faults 'Faults and hostile files' "$build/t_faults" full
    part olat 'Images, JSON and datasets' "$build/t_olat"
    part ply 'Model files' "$build/t_ply"
    part mutants 'Mutants of the backward passes' sh tests/mutants.sh "$build/mutants"
    if [ "$seconds" = - ] || [ -x "$build/fuzzers/all" ]; then
        for target in $targets; do
            part "fuzz_$target" "Fuzzing: $target" sh tests/fuzz/run.sh "$build/fuzzers" "$seconds" "$target"
        done
    else absent Fuzzing "clang's libFuzzer"; fi
    if [ "$seconds" = - ] || command -v gcov >/dev/null; then
        part coverage 'Coverage of ssdgs.h and of examples/olat.h with its parts' sh tests/coverage.sh "$build"
    else absent Coverage gcov; fi
    part levels 'Compilers: gcc and clang at every level' sh tests/matrix.sh "$build" levels
    part standards 'Compilers: C99 to C17, C++11 to C++20' sh tests/matrix.sh "$build" standards
    part machines 'Compilers and machines: tcc, musl, Windows, emulators, WebAssembly' sh tests/matrix.sh "$build" machines
} >"$out/parts"

# The catalogue's 86 rows, and 87 to 97, of scenes and files: how many held wherever they are tested, how many are tested, which are not.
set -- $(awk -F ' *[|] *' '
    NF == 5 && $2 ~ /^[0-9, ]+$/ && $4 ~ /^(passed|failed)$/ {
        n = split($2, row, ", ")
        for (i = 1; i <= n; i++) { seen[row[i] + 0] = 1; if ($4 == "failed") bad[row[i] + 0] = 1 }
    }
    END {
        for (i = 1; i <= 97; i++)
            if (i in seen) { total++; passed += !(i in bad) } else without = without (without ? "," : "") i
        print passed + 0, total + 0, without ? without : "none"
    }' "$out/parts")
{
    cat <<TEXT
# Figures

Made by \`make figures\` on ${cpu:-an unknown CPU}, $(${CC:-cc} --version 2>/dev/null | sed 1q). Every program's first
comment says what it measures and against what.

Rows are those of the stress catalogue, 86, and 87 to 97, of scenes and files; without a test: $3.

| figure | |
| --- | --- |
| stress_rows_passed | $1 |
| stress_rows_total | $2 |
TEXT
    cat "$out/parts"
} >"$out/FIGURES.md"

# The same figures; of a key that stands in several tables, the sum.
awk -F ' *[|] *' '
    NF == 4 && $2 ~ /^[a-z][a-z0-9_]*$/ && $3 ~ /^[-+0-9.e]+$/ { if (!($2 in sum)) key[++n] = $2; sum[$2] += $3 }
    END { printf "{\n"; for (i = 1; i <= n; i++) printf "  \"%s\": %s%s\n", key[i], sum[key[i]], i < n ? "," : ""; printf "}\n" }
' "$out/FIGURES.md" >"$build/figures.json"
echo "$out/FIGURES.md, $build/figures.json"
