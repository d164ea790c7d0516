#!/bin/sh
# npm's @playcanvas/splat-transform 3.7.0 and spz-js 1.2.5 make SPZ of a plain PLY with the positions as they are: a splat at (1, 2, 3)
# stays there. SPZ says of itself that y is up and z points back, and of PLY that mostly y is down and z points ahead. So one would guess
# that writers change the signs of y and z, as spz's own library does where it is told what axes the PLY has. Nothing in a file tells which
# was done: of one scene, a file by these and a file by that library differ by half a turn about x.
. "$(dirname "$0")/lib.sh"
packages @playcanvas/splat-transform@3.7.0 spz-js@1.2.5
node --input-type=module - <<'END'
import { readFileSync } from 'fs';
import { gunzipSync } from 'zlib';
import { loadPly, serializeSpz } from 'spz-js';
import { buffer, rows, splat, transform, vertices, write } from './files.mjs';
write('in.ply', vertices([splat]), rows([splat])); // at (1, 2, 3)
transform('in.ply', '--spz-version', '3', 'out.spz');
const files = {'splat-transform': readFileSync('out.spz'), 'spz-js': Buffer.from(await serializeSpz(await loadPly(new Blob([buffer('in.ply')]).stream())))};
let same = true;
for (const [name, packed] of Object.entries(files)) { // a header of 16 bytes, then positions of 24 bits, byte 13 of which are fractions
    const raw = gunzipSync(packed), place = [16, 19, 22].map(at => raw.readIntLE(at, 3) / (1 << raw[13]));
    console.log(`${name}: SPZ of version ${raw.readUInt32LE(4)}, (1, 2, 3) is at (${place.join(', ')})`);
    same = same && place.every((v, i) => Math.abs(v - 1 - i) < 0.001);
}
process.exit(same ? 0 : 1);
END
