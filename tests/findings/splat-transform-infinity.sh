#!/bin/sh
# npm's @playcanvas/splat-transform 3.7.0: a splat that is as good as opaque (opacity 12, before the sigmoid) or invisible (-8) comes back
# from .compressed.ply with an opacity of Infinity or -Infinity. The same tool's .spz reader gives 13.8 and -13.8 instead. -N, "remove most
# Inf values", keeps the opaque one. One would guess that finite values stay finite: programs that take infinity for a fault of the file
# refuse what was a sound model.
. "$(dirname "$0")/lib.sh"
packages @playcanvas/splat-transform@3.7.0
node --input-type=module - <<'END'
import { read, rows, splat, transform, vertices, write } from './files.mjs';
const splats = [{...splat, opacity: 12}, {...splat, opacity: -8}];
write('in.ply', vertices(splats), rows(splats));
const seen = {};
for (const format of ['compressed.ply', 'spz']) {
    transform('in.ply', 'middle.' + format);
    transform('middle.' + format, 'out.ply');
    seen[format] = read('out.ply').map(s => s.opacity).sort((a, b) => b - a);
}
transform('middle.compressed.ply', '-N', 'out.ply');
seen['compressed.ply -N'] = read('out.ply').map(s => s.opacity);
console.log(seen);
const [packed, spz] = [seen['compressed.ply'], seen.spz];
process.exit(packed[0] === Infinity && packed[1] === -Infinity && Math.abs(spz[0] - 13.8155) < 1e-3 && Math.abs(spz[1] + 13.8155) < 1e-3 && seen['compressed.ply -N'].includes(Infinity) ? 0 : 1);
END
