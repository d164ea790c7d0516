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
# splats at 0 and one step along each axis, in a file of their own; what became of them moves the dataset's cameras and lamps along
cat >"$work/move.js" <<'END'
const fs = require('fs'), [, , work, moved] = process.argv;
const names = ['x', 'y', 'z', 'f_dc_0', 'f_dc_1', 'f_dc_2', 'opacity', 'scale_0', 'scale_1', 'scale_2', 'rot_0', 'rot_1', 'rot_2', 'rot_3'];
if (!moved) {
    const rows = Buffer.alloc(4 * names.length * 4);
    for (let i = 0; i < 4; i++) [i == 1, i == 2, i == 3, i, 0, 0, 0, -3, -3, -3, 1, 0, 0, 0].forEach((v, c) => rows.writeFloatLE(+v, 4 * (names.length * i + c)));
    const head = 'ply\nformat binary_little_endian 1.0\nelement vertex 4\n' + names.map(n => `property float ${n}\n`).join('') + 'end_header\n';
    fs.writeFileSync(work + '/axes.ply', Buffer.concat([Buffer.from(head), rows]));
    process.exit();
}
const file = fs.readFileSync(moved), end = file.indexOf('end_header\n') + 11, found = [...file.toString('latin1', 0, end).matchAll(/property float (\w+)/g)].map(m => m[1]);
const at = {};
for (let i = 0; i < 4; i++) {
    const get = n => file.readFloatLE(end + 4 * (found.length * i + found.indexOf(n)));
    at[Math.round(get('f_dc_0'))] = [get('x'), get('y'), get('z')];
}
const axes = [1, 2, 3].map(k => at[k].map((v, c) => v - at[0][c])), scale = Math.hypot(...axes[0]); // columns
const turn = p => [0, 1, 2].map(c => (axes[0][c] * p[0] + axes[1][c] * p[1] + axes[2][c] * p[2]) / scale);
const place = p => turn(p).map((v, c) => scale * v + at[0][c]);
const set = JSON.parse(fs.readFileSync('examples/data/waxcow/transforms_test.json'));
for (const f of set.frames) {
    const m = f.transform_matrix, column = k => [0, 1, 2].map(i => m[i][k]), to = [turn(column(0)), turn(column(1)), turn(column(2)), place(column(3))];
    f.transform_matrix = [0, 1, 2].map(i => to.map(c => c[i])).concat([[0, 0, 0, 1]]);
    f.pl_pos = place(f.pl_pos);
    f.pl_intensity = [].concat(f.pl_intensity ?? 1).map(v => v * scale * scale);
}
fs.mkdirSync(work + '/set', {recursive: true});
fs.rmSync(work + '/set/test', {force: true});
fs.symlinkSync(fs.realpathSync('examples/data/waxcow/test'), work + '/set/test');
fs.writeFileSync(work + '/set/transforms_test.json', JSON.stringify(set));
END
node "$work/move.js" "$work"
moved_along() { # moved_along ACTION...: the dataset, of the actions that move
    set -- "$@" end
    while [ "$1" != end ]; do
        action=$1; shift
        case $action in
        -r | -t | -s) set -- "$@" "$action" "$1"; shift ;;
        -B | -V) shift ;;
        esac
    done
    shift
    rm -f "$work/moved.ply"
    "$work/node_modules/.bin/splat-transform" -q -w "$work/axes.ply" "$@" "$work/moved.ply" >"$work/log" 2>&1 && node "$work/move.js" "$work" "$work/moved.ply"
}
score() { # score MODEL: its PSNR before the moved dataset's photographs, with the networks of the original
    "$build/relight" "$1" "$work/set" --networks "$model" --split test --background black --out "$work/relit" >"$work/log" 2>&1 &&
        sed -n 's/^ "mean": {"psnr": \([-0-9.]*\).*/\1/p' "$work/relit/metrics.json"
}
near() { awk -v a="$1" -v b="$2" 'BEGIN { exit !(a != "" && a > b - 0.05 && a < b + 0.05) }'; } # near DB DB
as_good() { # as_good DB ACTION...: after these the model has so many dB
    wanted=$1; shift
    check "splat-transform $*" edit "$work/edited.ply" "$@"
    check "the dataset after $*" moved_along "$@"
    found=$(score "$work/edited.ply")
    check "$*: $found of $wanted dB" near "$found" "$wanted"
}
check "the dataset" moved_along
whole=$(score "$model")
check "the model: $whole dB" awk -v a="$whole" 'BEGIN { exit !(a > 25) }'
as_good "$whole" -m
as_good "$whole" -r 0,0,90
as_good "$whole" -r 30,40,50
in_one_file() { "$build/relight" "$work/relit/whole.ply" "$work/set" --split test --background black --out "$work/one" >"$work/log" 2>&1; }
check "the turned model in one file" in_one_file
check "the same picture of it" cmp "$work/relit/r_000.png" "$work/one/r_000.png"
exported() { "$build/export" "$1" "$work/exported" >"$work/log" 2>&1 && sed -n 's/^.*exported.ply: .* \([0-9.]*\) dB without its highlights$/\1/p' "$work/log"; }
check "exported as it stands: $(exported "$work/relit/whole.ply") and $(exported "$model") dB" \
    awk -v a="$(exported "$work/relit/whole.ply")" -v b="$(exported "$model")" 'BEGIN { exit !(a > 35 && a > b - 2) }'
as_good "$whole" -r 0,0,180
as_good "$whole" -t 0.5,0,0
as_good "$whole" -t 100,-200,300
as_good "$whole" -s 2
as_good "$whole" -s 0.01
as_good "$whole" -s 3 -r 30,40,50 -t 1,-2,3 -m
as_good "$whole" -m -t 1,-2,3 -r -100,20,70 -s 0.3
# rows that are missing: half of the object, cut off before or after; about every other one
check "a half" edit "$work/half.ply" -B -9,-9,-9,0.1,9,9
moved_along; half=$(score "$work/half.ply")
check "half of it: $half dB" awk -v a="$half" -v b="$whole" 'BEGIN { exit !(a > 5 && a < b - 3) }'
as_good "$half" -B -9,-9,-9,0.1,9,9 -m
as_good "$half" -B -9,-9,-9,0.1,9,9 -r 30,40,50
as_good "$half" -m -s 2 -B -18,-18,-18,0.2,18,18 -r 0,0,90 -t 3,2,1
check "every other one" edit "$work/half.ply" -V rot_1,gt,0
moved_along; thin=$(score "$work/half.ply")
check "thinned: $thin dB" awk -v a="$thin" -v b="$whole" 'BEGIN { exit !(a > 5 && a < b - 3) }'
as_good "$thin" -V rot_1,gt,0 -m -r 10,0,-60
as_good "$half" -t 1,1,1 -B -8,-8,-8,1.1,10,10
# packed: its compressed PLY is read as it reads it itself
packs() {
    "$build/export" "$model" "$work/plain" --keep >"$work/log" 2>&1 &&
        "$work/node_modules/.bin/splat-transform" -q -w "$work/plain.ply" "$work/packed.compressed.ply" >"$work/log" 2>&1 &&
        "$work/node_modules/.bin/splat-transform" -q -w "$work/packed.compressed.ply" "$work/unpacked.ply" >"$work/log" 2>&1
}
check "splat-transform packs" packs
check "unbake its compressed PLY" "$build/unbake" "$work/packed.compressed.ply" -o "$work/lit.ply" --keep 1
check "unbake what it unpacks" "$build/unbake" "$work/unpacked.ply" -o "$work/lit2.ply" --keep 1
check "the same model" cmp "$work/lit.ply" "$work/lit2.ply"
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
