#!/bin/sh
# npm's @playcanvas/splat-transform 3.7.0: splats so faint that their opacity rounds to 0 of 255 lose their colour in .sog: three of
# different colours come back with the lowest value that any splat has, in every channel. The colours lie in the RGB of a WebP picture and
# the opacity in its alpha; libwebp sets RGB to 0 where alpha is 0, unless asked to be exact. The tool calls these pictures lossless, and
# its .spz keeps these colours. One would guess so of .sog; who makes the splats more opaque afterwards has black ones.
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
const splats = [{}, {opacity: -8, f_dc_0: 1}, {opacity: -8, f_dc_0: -1}, {opacity: 3, f_dc_0: 1, f_dc_1: -1}].map((s, i) => ({...splat, x: i, ...s}));
write('in.ply', vertices(splats), rows(splats));
const seen = {};
for (const format of ['sog', 'spz']) {
    if (tool('-g', 'cpu', 'in.ply', 'middle.' + format).status || tool('middle.' + format, 'out.ply').status) throw 'it failed';
    seen[format] = read('out.ply').splats.sort((a, b) => a.x - b.x).map(s => [s.f_dc_0, s.f_dc_1, s.f_dc_2].map(v => +v.toFixed(2)));
}
console.log(seen);
const lost = c => c.every(v => v === -1);
process.exit(lost(seen.sog[1]) && lost(seen.sog[2]) && !lost(seen.sog[0]) && seen.sog[3][0] === 1 && Math.abs(seen.spz[1][0] - 1) < 0.1 && Math.abs(seen.spz[1][1] - 0.25) < 0.1 ? 0 : 1);
END
node see.mjs
