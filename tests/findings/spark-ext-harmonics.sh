#!/bin/sh
# npm's @sparkjsdev/spark 2.2.0 has extSplats for high precision. There the red, green and blue of a harmonic are bytes, 255 of them a power
# of two: the highest that is not above the largest of the three, and what exceeds it is cut. 0.3, 0.4 and 0.49 all become 0.25, 0.6 becomes
# 0.5, and a reddish 0.49 0.3 0.1 becomes a yellow 0.25 0.25 0.1. The compact form, the default, has 7 bits from -1 to 1, and keeps all of
# these to 1/126. One would guess that the higher precision is the better one, and that a power of two which three share is one that the
# largest fits under, as in OpenGL's RGB9_E5.
. "$(dirname "$0")/lib.sh"
packages @sparkjsdev/spark@2.2.0 three@0.187.0
node --input-type=module - <<'END'
import { buffer, rows, spark, splat, vertices, write } from './files.mjs';
const greys = [0.25, 0.3, 0.4, 0.49, 0.5, 0.6], harmonics = [...greys.map(v => [v, v, v]), [0.49, 0.3, 0.1], [-0.49, 0.3, 0.1]];
const splats = harmonics.map(rgb => Object.assign({...splat}, ...rgb.flatMap(v => [0, v, 0]).map((v, i) => ({['f_rest_' + i]: v})))); // z of degree 1
write('in.ply', vertices(splats), rows(splats));
const { ExtSplats, PackedSplats, SplatFileType, utils } = await spark();
const load = async kind => {
    const loaded = new kind({fileBytes: new Uint8Array(buffer('in.ply')), fileType: SplatFileType.PLY});
    await loaded.initialized;
    return loaded.extra.sh1;
};
const words = await load(ExtSplats), packed = await load(PackedSplats);
const ext = harmonics.map((_, i) => Object.assign({}, utils.decodeExtRgb(words[4 * i + 1]))).map(({ r, g, b }) => [r, g, b]); // of four words a splat
const reds = harmonics.map((_, i) => (packed[2 * i] << 4 >> 25) / 63); // bits 21 to 27 of 63
harmonics.forEach((rgb, i) => console.log(rgb.join(' '), '-> ext', ext[i].map(v => v.toFixed(3)).join(' '), '-> packed, red', reds[i].toFixed(3)));
const expected = [...[0.25, 0.25, 0.25, 0.25, 0.5, 0.5].map(v => [v, v, v]), [0.25, 0.25, 0.1], [-0.25, 0.25, 0.1]], near = (a, b, by) => Math.abs(a - b) < by;
process.exit(expected.every((rgb, i) => rgb.every((v, c) => near(ext[i][c], v, 0.001)) && near(reds[i], harmonics[i][0], 1 / 125)) ? 0 : 1);
END
