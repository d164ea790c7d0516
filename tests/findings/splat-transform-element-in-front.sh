#!/bin/sh
# npm's @playcanvas/splat-transform 3.7.0: a PLY with an element of one float in front of `vertex` is read without a word, but all values
# are shifted by that float: x is what the element holds, y is x, and so on. An element behind `vertex` is dropped, as is to be expected of
# a converter. PLY lets any elements stand in any order, and the header says how many bytes each has. One would guess that it skips the
# element or refuses the file.
. "$(dirname "$0")/lib.sh"
packages @playcanvas/splat-transform@3.7.0
node --input-type=module - <<'END'
import fs from 'node:fs';
import { floats, read, rows, splat, transform, vertices, write } from './files.mjs';
const camera = 'element camera 1\nproperty float focal\n';
write('behind.ply', vertices([splat]) + camera, rows([splat]), floats([42]));
write('front.ply', camera + vertices([splat]), floats([42]), rows([splat]));
const seen = ['behind', 'front'].map(n => {
    transform(n + '.ply', 'out.ply');
    const [first] = read('out.ply');
    console.log(n, fs.readFileSync('out.ply').includes('camera') ? 'kept' : 'dropped', first);
    return first;
});
process.exit(seen[0].x === 1 && seen[0].rot_0 === 1 && seen[1].x === 42 && seen[1].y === 1 && seen[1].z === 2 ? 0 : 1);
END
