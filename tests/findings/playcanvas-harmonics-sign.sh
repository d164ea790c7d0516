#!/bin/sh
# npm's playcanvas 2.23.3 keeps a splat's harmonics as fractions of the largest: it looks for it among the sizes of all but f_rest_0, which
# it takes with its sign. Where f_rest_0 is negative and larger than all others, it is cut to the size of the second largest, -0.5 to -0.1;
# where it is the only one that is not 0, the splat has no harmonics at all. 0.5 is kept, and so is -0.5 in any other place. Harmonics are
# as often below 0 as above, so one would guess that the sign does not matter. It is met: by chance in one of 18 splats of degree 1.
. "$(dirname "$0")/lib.sh"
packages playcanvas@2.23.3
node --input-type=module - <<'END'
import { Asset, GSplatHandler, NullGraphicsDevice } from 'playcanvas';
import { buffer, rows, splat, vertices, write } from './files.mjs';
const harmonics = [[-0.5, 0, 0, 0, 0, 0, 0, 0, 0], [-0.5, 0.1, 0, 0, 0, -0.1, 0, 0, 0], [0.5, 0, 0, 0, 0, 0, 0, 0, 0], [0.1, -0.5, 0, 0, 0, 0, 0, 0, 0.1]];
const splats = harmonics.map(values => Object.assign({...splat}, ...values.map((v, i) => ({['f_rest_' + i]: v}))));
write('in.ply', vertices(splats), rows(splats));
const handler = new GSplatHandler({graphicsDevice: new NullGraphicsDevice()}); // draws nothing, but reads
const asset = new Asset('splats', 'gsplat', {url: 'in.ply', contents: new Response(buffer('in.ply'))}, {reorder: false});
const loaded = await new Promise((done, fail) => handler.load('in.ply', (error, resource) => error ? fail(error) : done(resource), asset));
const words = loaded.streams.getTexture('splatSH_1to3').lock(), scales = new Float32Array(words.buffer);
const seen = harmonics.map((values, i) => { // four words: a float, and 11 + 10 + 11 bits for red, green, blue of each of three harmonics
    const fractions = [1, 2, 3].map(k => words[4 * i + k]).map(w => [(w >>> 21) / 2047, (w >>> 11 & 1023) / 1023, (w & 2047) / 2047]);
    return values.map((_, j) => (2 * fractions[j % 3][Math.floor(j / 3)] - 1) * scales[4 * i]);
});
const text = values => values.map(v => (Math.round(100 * v) / 100 || 0)).join(' ');
harmonics.forEach((values, i) => console.log(text(values), '->', text(seen[i])));
const near = (a, b) => a.every((v, j) => Math.abs(v - b[j]) < 0.001);
process.exit(seen[0].every(v => v === 0) && near(seen[1], harmonics[1].map(v => Math.max(v, -0.1))) && near(seen[2], harmonics[2]) && near(seen[3], harmonics[3]) ? 0 : 1);
END
