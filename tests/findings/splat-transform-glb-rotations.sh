#!/bin/sh
# npm's @playcanvas/splat-transform 3.7.0 writes the quaternions of a PLY into a GLB (KHR_gaussian_splatting) with the length they have: (2,
# 2, 0, 0) is written with a length of 2.8. Only the turn from PLY's axes to glTF's is put before it. Trainers may leave rot_* unnormalised
# in PLY, and viewers of those normalise. glTF's rotations are unit quaternions elsewhere, and the tool's own .spz and .sog hold unit ones.
# One would guess that a converter to glTF normalises.
. "$(dirname "$0")/lib.sh"
packages @playcanvas/splat-transform@3.7.0
node --input-type=module - <<'END'
import fs from 'node:fs';
import { read, rows, splat, transform, vertices, write } from './files.mjs';
const splats = [{...splat, rot_0: 2, rot_1: 2}];
write('in.ply', vertices(splats), rows(splats));
transform('in.ply', 'out.glb');
transform('in.ply', 'out.spz');
transform('out.spz', 'out.ply');
const bytes = fs.readFileSync('out.glb'), length = bytes.readUInt32LE(12), gltf = JSON.parse(bytes.toString('utf8', 20, 20 + length));
const accessor = gltf.accessors[gltf.meshes[0].primitives[0].attributes['KHR_gaussian_splatting:ROTATION']];
const at = 20 + length + 8 + (gltf.bufferViews[accessor.bufferView].byteOffset ?? 0) + (accessor.byteOffset ?? 0);
const glb = [0, 1, 2, 3].map(i => bytes.readFloatLE(at + 4 * i)), [s] = read('out.ply'), spz = [s.rot_0, s.rot_1, s.rot_2, s.rot_3];
console.log({glb, length: Math.hypot(...glb), spz, 'its length': Math.hypot(...spz)});
process.exit(accessor.componentType === 5126 && Math.abs(Math.hypot(...glb) - Math.sqrt(8)) < 1e-5 && Math.abs(Math.hypot(...spz) - 1) < 1e-3 ? 0 : 1);
END
