#!/bin/sh
# Splats in PLY that have red, green and blue (uchar) beside f_dc, scale, rot and opacity, for programs that show points alone. npm's
# @sparkjsdev/spark 2.2.0 takes every file with x y z red green blue for points, and drops all that makes these splats: each is a ball of
# radius 0.001, opaque, unturned, of that colour. In @babylonjs/core 9.28.0 the colour is what the header has last: red behind f_dc counts, red
# in front of it does not. playcanvas 2.23.3 takes f_dc. PLY is made so that properties can be added, and a reader passes over those it does
# not know. One would guess that more of them take nothing away, and that their order does not matter.
. "$(dirname "$0")/lib.sh"
packages @sparkjsdev/spark@2.2.0 three@0.187.0 @babylonjs/core@9.28.0 playcanvas@2.23.3
node --input-type=module - <<'END'
import { Asset, GSplatHandler, NullGraphicsDevice } from 'playcanvas'; // in front of what follows, which makes it take node for a browser
import { GaussianSplattingMesh } from '@babylonjs/core/Meshes/GaussianSplatting/gaussianSplattingMesh.js';
import { buffer, rows, spark, splat, write } from './files.mjs';
const { ExtSplats } = await spark();
const readers = { // radius along x, opacity, red
    spark: async file => {
        const splats = new ExtSplats({fileBytes: new Uint8Array(buffer(file)), fileName: file}), seen = [];
        await splats.initialized;
        splats.forEachSplat((i, center, scales, q, opacity, colour) => seen.push(scales.x, opacity, colour.r));
        return seen;
    },
    babylon: async file => {
        const {buffer: bytes} = await GaussianSplattingMesh.ConvertPLYWithSHToSplatAsync(buffer(file)), b = new Uint8Array(bytes);
        return [new Float32Array(bytes)[3], b[27] / 255, b[24] / 255];
    },
    playcanvas: async file => {
        const handler = new GSplatHandler({graphicsDevice: new NullGraphicsDevice()}); // draws nothing, but reads
        const asset = new Asset('splats', 'gsplat', {url: file, contents: new Response(buffer(file))});
        const load = (done, fail) => handler.load(file, (error, resource) => error ? fail(error) : done(resource), asset);
        const {gsplatData: d} = await new Promise(load);
        const value = name => d.getProp(name)[0];
        return [Math.exp(value('scale_0')), 1 / (1 + Math.exp(-value('opacity'))), 0.5 + 0.28209479 * value('f_dc_0')];
    },
};
const line = type => name => `property ${type} ${name}\n`, names = Object.keys(splat).map(line('float'));
const rgb = ['red', 'green', 'blue'].map(line('uchar')), bytes = rows([splat]), colour = Buffer.of(10, 100, 250);
const files = {
    'no red': [names, bytes],
    'red behind': [[...names, ...rgb], bytes, colour],
    'red in front of f_dc': [[...names.slice(0, 3), ...rgb, ...names.slice(3)], bytes.subarray(0, 12), colour, bytes.subarray(12)],
};
const seen = {};
for (const f in files) {
    write('in.ply', 'element vertex 1\n' + files[f][0].join(''), ...files[f].slice(1));
    for (const r in readers) {
        seen[r + ', ' + f] = (await readers[r]('in.ply')).map(v => v.toFixed(3)).join(' ');
        console.log(r + ', ' + f + ': radius, opacity, red:', seen[r + ', ' + f]);
    }
}
const near = (key, ...values) => seen[key].split(' ').every((v, i) => Math.abs(v - values[i]) < 0.003);
const whole = [0.0498, 0.731, 0.641], point = [0.001, 1, 10 / 255], rest = ['babylon, no red', 'babylon, red in front of f_dc', 'spark, no red'];
process.exit(near('spark, red behind', ...point) && near('spark, red in front of f_dc', ...point) &&
    near('babylon, red behind', 0.0498, 0.731, 10 / 255) &&
    [...rest, ...Object.keys(files).map(f => 'playcanvas, ' + f)].every(key => near(key, ...whole)) ? 0 : 1);
END
