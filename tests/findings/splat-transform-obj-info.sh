#!/bin/sh
# npm's @playcanvas/splat-transform 3.7.0 refuses a PLY whose header has an obj_info line: "unrecognized header line". A comment line it
# accepts. obj_info is as old as the format: Stanford's scans have it, and so has what some point cloud programs write. Readers skip it,
# such as gsplat 1.2.9 of npm here. One would guess that a line that holds no data is skipped as comments are.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 2' HUP INT TERM
for need in node npm; do command -v $need >/dev/null || { echo "apt-get install $need is needed"; exit 2; }; done
echo "node $(node --version); @playcanvas/splat-transform@3.7.0 gsplat@1.2.9"
npm install --silent --no-audit --no-fund --ignore-scripts --prefix "$work" @playcanvas/splat-transform@3.7.0 gsplat@1.2.9 >"$work/log" 2>&1 || { cat "$work/log"; echo "npm has none of these"; exit 2; }
cd "$work"
cat >see.mjs <<'END'
import { spawnSync } from 'node:child_process';
import { PLYLoader as GsplatLoader, Scene } from 'gsplat';
import fs from 'node:fs';
const names = 'x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3'.split(' ');
const splat = {x: 1, y: 2, z: 3, f_dc_0: 0.5, f_dc_1: 0.25, f_dc_2: 0.125, opacity: 1, scale_0: -3, scale_1: -4, scale_2: -5, rot_0: 1, rot_1: 0, rot_2: 0, rot_3: 0};
const floats = values => Buffer.from(new Float32Array(values).buffer);
const vertices = (splats, more = []) => `element vertex ${splats.length}\n` + [...names, ...more].map(n => `property float ${n}\n`).join('');
const rows = (splats, more = []) => floats(splats.flatMap(s => [...names, ...more].map(n => s[n])));
const write = (file, header, ...data) => fs.writeFileSync(file, Buffer.concat([Buffer.from(`ply\nformat binary_little_endian 1.0\n${header}end_header\n`), ...data]));
const tool = (...words) => spawnSync('node_modules/.bin/splat-transform', ['-q', '-w', ...words], {encoding: 'utf8'});
write('comment.ply', 'comment made by hand\n' + vertices([splat]), rows([splat]));
write('info.ply', 'obj_info made by hand\n' + vertices([splat]), rows([splat]));
const comment = tool('comment.ply', 'out.ply'), info = tool('info.ply', 'out.ply'), said = (info.stdout + info.stderr).match(/Error: .*/)?.[0];
const other = GsplatLoader.LoadFromArrayBuffer(new Uint8Array(fs.readFileSync('info.ply')).buffer, new Scene()).data.positions;
console.log({comment: comment.status, info: info.status, said, gsplat: [...other]});
process.exit(comment.status === 0 && info.status && /unrecognized header line/.test(said) && other[0] === 1 ? 0 : 1);
END
node see.mjs
