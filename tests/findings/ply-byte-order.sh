#!/bin/sh
# npm's @playcanvas/splat-transform 3.7.0 and gsplat 1.2.9 read a big-endian binary PLY as if it were little-endian: nothing is said, and x
# of 1 becomes 4.6e-41. splat-transform reads the text of an ASCII PLY as floats too, where it is long enough. three's PLYLoader reads all
# three. The second line of the header names the format, and spz-js 1.2.5 refuses what it does not know. One would guess that these read or
# refuse them too.
. "$(dirname "$0")/lib.sh"
packages @playcanvas/splat-transform@3.7.0 gsplat@1.2.9 three@0.187.0
node --input-type=module - <<'END'
import { PLYLoader as ThreeLoader } from 'three/examples/jsm/loaders/PLYLoader.js';
import { PLYLoader as GsplatLoader, Scene } from 'gsplat';
import fs from 'node:fs';
import { buffer, floats, read, splat, transform, vertices } from './files.mjs';
const values = Object.values(splat), big = floats(values).swap32(), text = Buffer.from(values.map(v => v.toFixed(6)).join(' ') + '\n');
const put = (file, format, data) => fs.writeFileSync(file, Buffer.concat([Buffer.from(`ply\nformat ${format} 1.0\n${vertices([splat])}end_header\n`), data]));
put('big.ply', 'binary_big_endian', big);
put('text.ply', 'ascii', text);
const seen = {};
for (const file of ['big.ply', 'text.ply']) {
    transform(file, 'out.ply');
    seen['splat-transform ' + file] = read('out.ply')[0].x;
    seen['three ' + file] = new ThreeLoader().parse(buffer(file)).attributes.position.array[0];
}
seen['gsplat big.ply'] = GsplatLoader.LoadFromArrayBuffer(buffer('big.ply'), new Scene()).data.positions[0];
console.log(seen);
const tiny = v => v > 0 && v < 1e-6;
process.exit(tiny(seen['splat-transform big.ply']) && tiny(seen['splat-transform text.ply']) && tiny(seen['gsplat big.ply']) && seen['three big.ply'] === 1 && seen['three text.ply'] === 1 ? 0 : 1);
END
