#!/bin/sh
# usage: editors.sh BUILD [install]: a model that went through an editor of splats, splat-transform of npm, and gets its networks back is
# as good as it was. Version 3.7.0 keeps our properties of vertices, in another order, and drops the elements behind them; it turns
# positions and rot_*, but neither nx ny nz nor local_q_*. Closes with "N passed, N failed".
set -u
build=$1 work=$1/editors passed=0 failed=0 tool=@playcanvas/splat-transform version=3.7.0
check() { # check NAME COMMAND...
    name=$1; shift
    if "$@"; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "failed: $name"; fi
}
mkdir -p "$work"
grep -qs "\"version\": \"$version\"" "$work/node_modules/$tool/package.json" ||
    npm install --silent --no-audit --no-fund --fetch-timeout=20000 --fetch-retries=0 --prefix "$work" "$tool@$version" >/dev/null || {
    echo "npm has no $tool $version"; exit 2; }
[ "${2:-}" != install ] || exit 0
model=examples/data/waxcow.ply
edit() { # edit FILE ACTION...: the model with what an editor does to it
    file=$1; shift
    "$work/node_modules/.bin/splat-transform" -q -w "$model" "$@" "$file" >"$work/log" 2>&1 && LC_ALL=C grep -aq "^property float local_q_3" "$file" &&
        ! LC_ALL=C grep -aq "^element ssdgs_settings" "$file"
}
score() { # score MODEL: its PSNR, with the networks of the original
    "$build/relight" "$1" examples/data/waxcow --networks "$model" --split test --background black --out "$work/relit" >"$work/log" 2>&1 &&
        sed -n 's/^ "mean": {"psnr": \([-0-9.]*\).*/\1/p' "$work/relit/metrics.json"
}
near() { awk -v a="$1" -v b="$2" 'BEGIN { exit !(a != "" && a > b - 0.05 && a < b + 0.05) }'; } # near DB DB
as_good() { # as_good DB ACTION...: after these the model has so many dB
    wanted=$1; shift
    check "splat-transform $*" edit "$work/edited.ply" "$@"
    found=$(score "$work/edited.ply")
    check "$*: $found of $wanted dB" near "$found" "$wanted"
}
whole=$(score "$model")
check "the model: $whole dB" awk -v a="$whole" 'BEGIN { exit !(a > 25) }'
as_good "$whole" -m
as_good "$whole" -r 0,0,90
as_good "$whole" -r 30,40,50
as_good "$whole" -r 0,0,180
as_good "$whole" -t 0.5,0,0
as_good "$whole" -t 100,-200,300
as_good "$whole" -s 2
as_good "$whole" -s 0.01
as_good "$whole" -s 3 -r 30,40,50 -t 1,-2,3 -m
as_good "$whole" -m -t 1,-2,3 -r -100,20,70 -s 0.3
# rows that are missing: half of the object, cut off before or after; about every other one
check "a half" edit "$work/half.ply" -B -9,-9,-9,0.1,9,9
half=$(score "$work/half.ply")
check "half of it: $half dB" awk -v a="$half" -v b="$whole" 'BEGIN { exit !(a > 5 && a < b - 3) }'
as_good "$half" -B -9,-9,-9,0.1,9,9 -m
as_good "$half" -B -9,-9,-9,0.1,9,9 -r 30,40,50
as_good "$half" -m -s 2 -B -18,-18,-18,0.2,18,18 -r 0,0,90 -t 3,2,1
check "every other one" edit "$work/half.ply" -V rot_1,gt,0
thin=$(score "$work/half.ply")
check "thinned: $thin dB" awk -v a="$thin" -v b="$whole" 'BEGIN { exit !(a > 5 && a < b - 3) }'
as_good "$thin" -V rot_1,gt,0 -m -r 10,0,-60
as_good "$half" -t 1,1,1 -B -8,-8,-8,1.1,10,10
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
