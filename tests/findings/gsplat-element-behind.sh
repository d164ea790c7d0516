#!/bin/sh
# npm's gsplat 1.2.9 takes the properties of every element for properties of vertices. A PLY with an element of one float behind `vertex` is
# read without a word where both have two rows: the second splat's x is the first's next value. It throws where the element has but one row
# ("outside the bounds"). spz-js 1.2.5 throws at both. three's PLYLoader 0.187.0 and @loaders.gl/ply 4.4.5 read both: a PLY may have any
# elements, and a reader of vertices is done before the others begin. One would guess that all splat readers ignore what comes behind.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 2' HUP INT TERM
for need in node npm; do command -v $need >/dev/null || { echo "apt-get install $need is needed"; exit 2; }; done
echo "node $(node --version); gsplat@1.2.9 spz-js@1.2.5 three@0.187.0 @loaders.gl/core@4.4.5 @loaders.gl/ply@4.4.5"
npm install --silent --no-audit --no-fund --ignore-scripts --prefix "$work" gsplat@1.2.9 spz-js@1.2.5 three@0.187.0 @loaders.gl/core@4.4.5 @loaders.gl/ply@4.4.5 >"$work/log" 2>&1 || { cat "$work/log"; echo "npm has none of these"; exit 2; }
cd "$work"
cat >see.mjs <<'END'
import { PLYLoader as ThreeLoader } from 'three/examples/jsm/loaders/PLYLoader.js';
import { PLYLoader as GsplatLoader, Scene } from 'gsplat';
import { PLYLoader as LoadersLoader } from '@loaders.gl/ply';
import { parse } from '@loaders.gl/core';
import { loadPly } from 'spz-js';
import fs from 'node:fs';
const names = 'x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3'.split(' ');
const splat = {x: 1, y: 2, z: 3, f_dc_0: 0.5, f_dc_1: 0.25, f_dc_2: 0.125, opacity: 1, scale_0: -3, scale_1: -4, scale_2: -5, rot_0: 1, rot_1: 0, rot_2: 0, rot_3: 0};
const floats = values => Buffer.from(new Float32Array(values).buffer);
const vertices = (splats, more = []) => `element vertex ${splats.length}\n` + [...names, ...more].map(n => `property float ${n}\n`).join('');
const rows = (splats, more = []) => floats(splats.flatMap(s => [...names, ...more].map(n => s[n])));
const write = (file, header, ...data) => fs.writeFileSync(file, Buffer.concat([Buffer.from(`ply\nformat binary_little_endian 1.0\n${header}end_header\n`), ...data]));
const splats = [splat, {...splat, x: 9}], file = 'in.ply';
const readers = {
    three: data => new ThreeLoader().parse(data.buffer).attributes.position.array,
    'loaders.gl': async data => (await parse(data.buffer, LoadersLoader, {worker: false})).attributes.POSITION.value,
    gsplat: data => GsplatLoader.LoadFromArrayBuffer(data.buffer, new Scene()).data.positions,
    'spz-js': async data => (await loadPly(new Blob([data]).stream())).positions,
};
const seen = {};
for (const n of [0, 2, 1]) {
    write(file, vertices(splats) + (n ? `element camera ${n}\nproperty float focal\n` : ''), rows(splats), floats(Array(n).fill(42)));
    for (const r in readers) {
        try { seen[r + ' ' + n] = [...await readers[r](new Uint8Array(fs.readFileSync(file)))].join(' '); }
        catch (error) { seen[r + ' ' + n] = 'throws: ' + error.message; }
    }
}
console.log(seen);
const right = '1 2 3 9 2 3', throws = s => s.startsWith('throws');
process.exit(Object.keys(readers).every(r => seen[r + ' 0'] === right) && ['three 1', 'three 2', 'loaders.gl 1', 'loaders.gl 2'].every(k => seen[k] === right) &&
    seen['gsplat 2'] === '1 2 3 2 3 0.5' && throws(seen['gsplat 1']) && throws(seen['spz-js 1']) && throws(seen['spz-js 2']) ? 0 : 1);
END
node see.mjs
