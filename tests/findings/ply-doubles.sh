#!/bin/sh
# Of splats whose x y z are doubles, as PLY allows and surveyed scenes need, npm's @mkkellogg/gaussian-splats-3d 0.4.7 puts every one where the
# last splat of the file read before stood (NaN where there was none), and spz-js 1.2.5 puts all at 0; neither says a word. gsplat 1.2.9 refuses
# the type. splat-transform 3.7.0 and three's PLYLoader 0.187.0 read them. One would guess that a reader that knows the size of a double, as the
# first two do, reads it, and that what one file says nothing of does not come from another.
. "$(dirname "$0")/lib.sh"
packages @mkkellogg/gaussian-splats-3d@0.4.7 spz-js@1.2.5 gsplat@1.2.9 @playcanvas/splat-transform@3.7.0 three@0.187.0
node --input-type=module - <<'END'
import { PLYLoader as ThreeLoader } from 'three/examples/jsm/loaders/PLYLoader.js';
import { PLYLoader as GsplatLoader, Scene } from 'gsplat';
import { loadPly } from 'spz-js';
import { buffer, floats, read, rows, splat, transform, vertices, write } from './files.mjs';
globalThis.window ??= globalThis; // for gaussian-splats-3d
const { PlyParser } = await import('@mkkellogg/gaussian-splats-3d');
const before = [{...splat, x: 7}], splats = [splat, {...splat, x: 9}];
write('before.ply', vertices(before), rows(before));
write('doubles.ply', vertices(splats).replace(/float ([xyz])\n/g, 'double $1\n'), ...splats.flatMap(s => {
    const [x, y, z, ...rest] = Object.values(s);
    return [Buffer.from(new Float64Array([x, y, z]).buffer), floats(rest)];
}));
const mkkellogg = file => PlyParser.parseToUncompressedSplatArray(buffer(file)).splats.flatMap(s => s.slice(0, 3));
const readers = {
    'gaussian-splats-3d first': () => mkkellogg('doubles.ply'),
    'gaussian-splats-3d of floats': () => mkkellogg('before.ply'),
    'gaussian-splats-3d after it': () => mkkellogg('doubles.ply'),
    'spz-js': async () => (await loadPly(new Blob([buffer('doubles.ply')]).stream())).positions,
    gsplat: () => GsplatLoader.LoadFromArrayBuffer(buffer('doubles.ply'), new Scene()).data.positions,
    'splat-transform': () => { transform('doubles.ply', 'out.ply'); return read('out.ply').flatMap(s => [s.x, s.y, s.z]); },
    three: () => new ThreeLoader().parse(buffer('doubles.ply')).attributes.position.array,
};
const wanted = {
    'gaussian-splats-3d first': 'NaN NaN NaN NaN NaN NaN', 'gaussian-splats-3d of floats': '7 2 3', 'gaussian-splats-3d after it': '7 2 3 7 2 3',
    'spz-js': '0 0 0 0 0 0', gsplat: 'throws: Unsupported property type: double', 'splat-transform': '1 2 3 9 2 3', three: '1 2 3 9 2 3',
};
const seen = {};
for (const r in readers) {
    try { seen[r] = [...await readers[r]()].map(Number).join(' '); }
    catch (error) { seen[r] = 'throws: ' + error.message; }
}
console.log(seen);
process.exit(Object.keys(readers).every(r => seen[r] === wanted[r]) ? 0 : 1);
END
