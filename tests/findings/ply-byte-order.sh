#!/bin/sh
# npm's @playcanvas/splat-transform 3.7.0 and gsplat 1.2.9 read a big-endian binary PLY as if it were little-endian: nothing is said, and x
# of 1 becomes 4.6e-41. splat-transform reads the text of an ASCII PLY as floats too, where it is long enough. three's PLYLoader reads all
# three. The second line of the header names the format, and spz-js 1.2.5 refuses what it does not know. One would guess that these read or
# refuse them too.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 2' HUP INT TERM
for need in node npm; do command -v $need >/dev/null || { echo "apt-get install $need is needed"; exit 2; }; done
echo "node $(node --version); @playcanvas/splat-transform@3.7.0 gsplat@1.2.9 three@0.187.0"
npm install --silent --no-audit --no-fund --ignore-scripts --prefix "$work" @playcanvas/splat-transform@3.7.0 gsplat@1.2.9 three@0.187.0 >"$work/log" 2>&1 || { cat "$work/log"; echo "npm has none of these"; exit 2; }
cd "$work"
cat >see.mjs <<'END'
import { spawnSync } from 'node:child_process';
import { PLYLoader as ThreeLoader } from 'three/examples/jsm/loaders/PLYLoader.js';
import { PLYLoader as GsplatLoader, Scene } from 'gsplat';
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
const values = names.map(n => splat[n]), big = floats(values).swap32(), text = Buffer.from(values.map(v => v.toFixed(6)).join(' ') + '\n');
const put = (file, format, data) => fs.writeFileSync(file, Buffer.concat([Buffer.from(`ply\nformat ${format} 1.0\n${vertices([splat])}end_header\n`), data]));
put('big.ply', 'binary_big_endian', big);
put('text.ply', 'ascii', text);
const buffer = file => new Uint8Array(fs.readFileSync(file)).buffer;
const seen = {};
for (const file of ['big.ply', 'text.ply']) {
    if (tool(file, 'out.ply').status) throw 'it failed';
    seen['splat-transform ' + file] = read('out.ply').splats[0].x;
    seen['three ' + file] = new ThreeLoader().parse(buffer(file)).attributes.position.array[0];
}
seen['gsplat big.ply'] = GsplatLoader.LoadFromArrayBuffer(buffer('big.ply'), new Scene()).data.positions[0];
console.log(seen);
const tiny = v => v > 0 && v < 1e-6;
process.exit(tiny(seen['splat-transform big.ply']) && tiny(seen['splat-transform text.ply']) && tiny(seen['gsplat big.ply']) && seen['three big.ply'] === 1 && seen['three text.ply'] === 1 ? 0 : 1);
END
node see.mjs
