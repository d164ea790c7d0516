#!/bin/sh
# npm's @playcanvas/splat-transform 3.7.0: a PLY with an element of one float in front of `vertex` is read without a word, but all values
# are shifted by that float: x is what the element holds, y is x, and so on. An element behind `vertex` is dropped, as is to be expected of
# a converter. PLY lets any elements stand in any order, and the header says how many bytes each has. One would guess that it skips the
# element or refuses the file.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 2' HUP INT TERM
for need in node npm; do command -v $need >/dev/null || { echo "apt-get install $need is needed"; exit 2; }; done
echo "node $(node --version); @playcanvas/splat-transform@3.7.0"
npm install --silent --no-audit --no-fund --ignore-scripts --prefix "$work" @playcanvas/splat-transform@3.7.0 >"$work/log" 2>&1 || { cat "$work/log"; echo "npm has none of these"; exit 2; }
cd "$work"
cat >see.mjs <<'END'
import { spawnSync } from 'node:child_process';
import fs from 'node:fs';
const names = 'x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3'.split(' ');
const splat = {x: 1, y: 2, z: 3, f_dc_0: 0.5, f_dc_1: 0.25, f_dc_2: 0.125, opacity: 1, scale_0: -3, scale_1: -4, scale_2: -5, rot_0: 1, rot_1: 0, rot_2: 0, rot_3: 0};
const floats = values => Buffer.from(new Float32Array(values).buffer);
const vertices = (splats, more = []) => `element vertex ${splats.length}\n` + [...names, ...more].map(n => `property float ${n}\n`).join('');
const rows = (splats, more = []) => floats(splats.flatMap(s => [...names, ...more].map(n => s[n])));
const write = (file, header, ...data) => fs.writeFileSync(file, Buffer.concat([Buffer.from(`ply\nformat binary_little_endian 1.0\n${header}end_header\n`), ...data]));
const read = file => { // the rows of a PLY of nothing but floats
    const bytes = fs.readFileSync(file), at = bytes.indexOf('end_header\n') + 11, header = bytes.toString('latin1', 0, at);
    if (!header.includes('format binary_little_endian 1.0')) throw 'it wrote another format';
    const found = [...header.matchAll(/property float (\w+)/g)].map(m => m[1]);
    return {header, splats: Array.from({length: +header.match(/element vertex (\d+)/)[1]}, (_, i) =>
        Object.fromEntries(found.map((n, c) => [n, bytes.readFloatLE(at + 4 * (found.length * i + c))])))};
};
const tool = (...words) => spawnSync('node_modules/.bin/splat-transform', ['-q', '-w', ...words], {encoding: 'utf8'});
const camera = 'element camera 1\nproperty float focal\n';
write('behind.ply', vertices([splat]) + camera, rows([splat]), floats([42]));
write('front.ply', camera + vertices([splat]), floats([42]), rows([splat]));
const seen = ['behind', 'front'].map(n => {
    if (tool(n + '.ply', 'out.ply').status) throw 'it failed';
    const {header, splats} = read('out.ply');
    console.log(n, header.includes('camera') ? 'kept' : 'dropped', splats[0]);
    return splats[0];
});
process.exit(seen[0].x === 1 && seen[0].rot_0 === 1 && seen[1].x === 42 && seen[1].y === 1 && seen[1].z === 2 ? 0 : 1);
END
node see.mjs
