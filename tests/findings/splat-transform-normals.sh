#!/bin/sh
# npm's @playcanvas/splat-transform 3.7.0: -r turns positions and rot_*, but leaves nx ny nz as they were. They then are no normals any
# more. nx ny nz are in every PLY of the first 3D Gaussian splatting program, and mean normals in every other PLY. One would guess that a
# tool which turns even spherical harmonics turns them too, or drops them.
. "$(dirname "$0")/lib.sh"
packages @playcanvas/splat-transform@3.7.0
node --input-type=module - <<'END'
import { read, rows, splat, transform, vertices, write } from './files.mjs';
const near = (a, b) => Math.abs(a - b) < 1e-5;
const splats = [{...splat, nx: 1, ny: 0, nz: 0}];
write('in.ply', vertices(splats), rows(splats));
transform('in.ply', '-r', '0,0,90', 'out.ply');
const [s] = read('out.ply');
console.log(s);
const turned = near(s.x, -2) && near(s.y, 1) && near(s.rot_0, Math.SQRT1_2) && near(s.rot_3, Math.SQRT1_2);
process.exit(turned && s.nx === 1 && s.ny === 0 && s.nz === 0 ? 0 : 1);
END
