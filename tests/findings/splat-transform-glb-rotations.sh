#!/bin/sh
# npm's @playcanvas/splat-transform 3.7.0 writes the quaternions of a PLY into a GLB (KHR_gaussian_splatting) with the length they have: (2,
# 2, 0, 0) is written with a length of 2.8. Only the turn from PLY's axes to glTF's is put before it. Trainers may leave rot_* unnormalised
# in PLY, and viewers of those normalise. glTF's rotations are unit quaternions elsewhere, and the tool's own .spz and .sog hold unit ones.
# One would guess that a converter to glTF normalises.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 2' HUP INT TERM
for need in node npm; do command -v $need >/dev/null || { echo "apt-get install $need is needed"; exit 2; }; done
echo "node $(node --version); @playcanvas/splat-transform@3.7.0"
npm install --silent --no-audit --no-fund --ignore-scripts --prefix "$work" @playcanvas/splat-transform@3.7.0 >"$work/log" 2>&1 || { cat "$work/log"; echo "npm has none of these"; exit 2; }
cd "$work"
cat >see.mjs <<'END'
import { spawnSync } from 'node:child_process';
import fs from 'node:fs';
const names = 'x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3'.split(' ');
const splat = {x: 1, y: 2, z: 3, f_dc_0: 0.5, f_dc_1: 0.25, f_dc_2: 0.125, opacity: 1, scale_0: -3, scale_1: -4, scale_2: -5, rot_0: 1, rot_1: 0, rot_2: 0, rot_3: 0};
const floats = values => Buffer.from(new Float32Array(values).buffer);
const vertices = (splats, more = []) => `element vertex ${splats.length}\n` + [...names, ...more].map(n => `property float ${n}\n`).join('');
const rows = (splats, more = []) => floats(splats.flatMap(s => [...names, ...more].map(n => s[n])));
const write = (file, header, ...data) => fs.writeFileSync(file, Buffer.concat([Buffer.from(`ply\nformat binary_little_endian 1.0\n${header}end_header\n`), ...data]));
const read = file => { // the rows of a PLY of nothing but floats
    const bytes = fs.readFileSync(file), at = bytes.indexOf('end_header\n') + 11, header = bytes.toString('latin1', 0, at);
    if (!header.includes('format binary_little_endian 1.0')) throw 'it wrote another format';
    const found = [...header.matchAll(/property float (\w+)/g)].map(m => m[1]);
    return {header, splats: Array.from({length: +header.match(/element vertex (\d+)/)[1]}, (_, i) =>
        Object.fromEntries(found.map((n, c) => [n, bytes.readFloatLE(at + 4 * (found.length * i + c))])))};
};
const tool = (...words) => spawnSync('node_modules/.bin/splat-transform', ['-q', '-w', ...words], {encoding: 'utf8'});
const splats = [{...splat, rot_0: 2, rot_1: 2}];
write('in.ply', vertices(splats), rows(splats));
if (tool('in.ply', 'out.glb').status || tool('in.ply', 'out.spz').status || tool('out.spz', 'out.ply').status) throw 'it failed';
const bytes = fs.readFileSync('out.glb'), length = bytes.readUInt32LE(12), gltf = JSON.parse(bytes.toString('utf8', 20, 20 + length));
const accessor = gltf.accessors[gltf.meshes[0].primitives[0].attributes['KHR_gaussian_splatting:ROTATION']];
const at = 20 + length + 8 + (gltf.bufferViews[accessor.bufferView].byteOffset ?? 0) + (accessor.byteOffset ?? 0);
const glb = [0, 1, 2, 3].map(i => bytes.readFloatLE(at + 4 * i)), s = read('out.ply').splats[0], spz = [s.rot_0, s.rot_1, s.rot_2, s.rot_3];
console.log({glb, length: Math.hypot(...glb), spz, 'its length': Math.hypot(...spz)});
process.exit(accessor.componentType === 5126 && Math.abs(Math.hypot(...glb) - Math.sqrt(8)) < 1e-5 && Math.abs(Math.hypot(...spz) - 1) < 1e-3 ? 0 : 1);
END
node see.mjs
