#!/bin/sh
# npm's @playcanvas/splat-transform 3.7.0: -r turns positions and rot_*, but leaves nx ny nz as they were. They then are no normals any
# more. nx ny nz are in every PLY of the first 3D Gaussian splatting program, and mean normals in every other PLY. One would guess that a
# tool which turns even spherical harmonics turns them too, or drops them.
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
const near = (a, b) => Math.abs(a - b) < 1e-5;
write('in.ply', vertices([splat], ['nx', 'ny', 'nz']), rows([{...splat, nx: 1, ny: 0, nz: 0}], ['nx', 'ny', 'nz']));
if (tool('in.ply', '-r', '0,0,90', 'out.ply').status) throw 'it failed';
const s = read('out.ply').splats[0];
console.log(s);
const turned = near(s.x, -2) && near(s.y, 1) && near(s.rot_0, Math.SQRT1_2) && near(s.rot_3, Math.SQRT1_2);
process.exit(turned && s.nx === 1 && s.ny === 0 && s.nz === 0 ? 0 : 1);
END
node see.mjs
