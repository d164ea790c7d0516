#!/bin/sh
# npm's gsplat 1.2.9 takes the properties of every element for properties of vertices. A PLY with an element of one float behind `vertex` is
# read without a word where both have two rows: the second splat's x is the first's next value. It throws where the element has but one row
# ("outside the bounds"). spz-js 1.2.5 throws at both. three's PLYLoader 0.187.0 and @loaders.gl/ply 4.4.5 read both: a PLY may have any
# elements, and a reader of vertices is done before the others begin. One would guess that all splat readers ignore what comes behind.
. "$(dirname "$0")/lib.sh"
packages gsplat@1.2.9 spz-js@1.2.5 three@0.187.0 @loaders.gl/core@4.4.5 @loaders.gl/ply@4.4.5
node --input-type=module - <<'END'
import { PLYLoader as ThreeLoader } from 'three/examples/jsm/loaders/PLYLoader.js';
import { PLYLoader as GsplatLoader, Scene } from 'gsplat';
import { PLYLoader as LoadersLoader } from '@loaders.gl/ply';
import { parse } from '@loaders.gl/core';
import { loadPly } from 'spz-js';
import { buffer, floats, rows, splat, vertices, write } from './files.mjs';
const splats = [splat, {...splat, x: 9}], file = 'in.ply';
const readers = {
    three: data => new ThreeLoader().parse(data).attributes.position.array,
    'loaders.gl': async data => (await parse(data, LoadersLoader, {worker: false})).attributes.POSITION.value,
    gsplat: data => GsplatLoader.LoadFromArrayBuffer(data, new Scene()).data.positions,
    'spz-js': async data => (await loadPly(new Blob([data]).stream())).positions,
};
const seen = {};
for (const n of [0, 2, 1]) {
    write(file, vertices(splats) + (n ? `element camera ${n}\nproperty float focal\n` : ''), rows(splats), floats(Array(n).fill(42)));
    for (const r in readers) {
        try { seen[r + ' ' + n] = [...await readers[r](buffer(file))].join(' '); }
        catch (error) { seen[r + ' ' + n] = 'throws: ' + error.message; }
    }
}
console.log(seen);
const right = '1 2 3 9 2 3', throws = s => s.startsWith('throws');
process.exit(Object.keys(readers).every(r => seen[r + ' 0'] === right) && ['three 1', 'three 2', 'loaders.gl 1', 'loaders.gl 2'].every(k => seen[k] === right) &&
    seen['gsplat 2'] === '1 2 3 2 3 0.5' && throws(seen['gsplat 1']) && throws(seen['spz-js 1']) && throws(seen['spz-js 2']) ? 0 : 1);
END
