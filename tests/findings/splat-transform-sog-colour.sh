#!/bin/sh
# npm's @playcanvas/splat-transform 3.7.0: splats so faint that their opacity rounds to 0 of 255 lose their colour in .sog: three of
# different colours come back with the lowest value that any splat has, in every channel. The colours lie in the RGB of a WebP picture and
# the opacity in its alpha; libwebp sets RGB to 0 where alpha is 0, unless asked to be exact. The tool calls these pictures lossless, and
# its .spz keeps these colours. One would guess so of .sog; who makes the splats more opaque afterwards has black ones.
. "$(dirname "$0")/lib.sh"
packages @playcanvas/splat-transform@3.7.0
node --input-type=module - <<'END'
import { read, rows, splat, transform, vertices, write } from './files.mjs';
const splats = [{}, {opacity: -8, f_dc_0: 1}, {opacity: -8, f_dc_0: -1}, {opacity: 3, f_dc_0: 1, f_dc_1: -1}].map((s, i) => ({...splat, x: i, ...s}));
write('in.ply', vertices(splats), rows(splats));
const seen = {};
for (const format of ['sog', 'spz']) {
    transform('-g', 'cpu', 'in.ply', 'middle.' + format);
    transform('middle.' + format, 'out.ply');
    seen[format] = read('out.ply').sort((a, b) => a.x - b.x).map(s => [s.f_dc_0, s.f_dc_1, s.f_dc_2].map(v => +v.toFixed(2)));
}
console.log(seen);
const lost = c => c.every(v => v === -1);
process.exit(lost(seen.sog[1]) && lost(seen.sog[2]) && !lost(seen.sog[0]) && seen.sog[3][0] === 1 && Math.abs(seen.spz[1][0] - 1) < 0.1 && Math.abs(seen.spz[1][1] - 0.25) < 0.1 ? 0 : 1);
END
