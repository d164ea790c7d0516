#!/bin/sh
# npm's @playcanvas/splat-transform 3.7.0 refuses a PLY whose header has an obj_info line: "unrecognized header line". A comment line it
# accepts. obj_info is as old as the format: Stanford's scans have it, and so has what some point cloud programs write. Readers skip it,
# such as gsplat 1.2.9 of npm here. One would guess that a line that holds no data is skipped as comments are.
. "$(dirname "$0")/lib.sh"
packages @playcanvas/splat-transform@3.7.0 gsplat@1.2.9
node --input-type=module - <<'END'
import { PLYLoader as GsplatLoader, Scene } from 'gsplat';
import { buffer, rows, splat, transform, vertices, write } from './files.mjs';
write('comment.ply', 'comment made by hand\n' + vertices([splat]), rows([splat]));
write('info.ply', 'obj_info made by hand\n' + vertices([splat]), rows([splat]));
transform('comment.ply', 'out.ply');
let said;
try { transform('info.ply', 'out.ply'); }
catch (error) { said = `${error.stdout}${error.stderr}`.match(/Error: .*/)?.[0]; }
const other = GsplatLoader.LoadFromArrayBuffer(buffer('info.ply'), new Scene()).data.positions;
console.log({said, gsplat: [...other]});
process.exit(/unrecognized header line/.test(said) && other[0] === 1 ? 0 : 1);
END
