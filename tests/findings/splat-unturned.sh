#!/bin/sh
# .splat, the format of antimatter15's viewer, stores each part of a unit quaternion in a byte, as 128 q + 128 cut to 255. An unturned splat
# is 255 128 128 128, and reads (0.992, 0, 0, 0) by (b - 128) / 128. npm's @playcanvas/splat-transform 3.7.0 takes (b - 127.5) / 127.5: it
# turns such a splat by 0.8 degrees. @sparkjsdev/spark 2.2.0 does not normalise 0.992, takes its arc cosine, and turns it by 14 degrees
# around z. gsplat 1.2.9 keeps (0.992, 0, 0, 0). The bytes are so few that one would guess all readers agree, and that no turn is no turn in
# each.
. "$(dirname "$0")/lib.sh"
packages @playcanvas/splat-transform@3.7.0 @sparkjsdev/spark@2.2.0 three@0.187.0 gsplat@1.2.9
node --input-type=module - <<'END'
import fs from 'node:fs';
import { floats, read, spark, transform } from './files.mjs';
const bytes = Buffer.concat([floats([1, 2, 3, 0.1, 0.2, 0.3]), Buffer.from([255, 128, 0, 255, 255, 128, 128, 128])]);
fs.writeFileSync('in.splat', bytes);
transform('in.splat', 'out.ply');
const [s] = read('out.ply'), seen = {'splat-transform': [s.rot_0, s.rot_1, s.rot_2, s.rot_3]}; // w x y z
const module = await spark(), splats = new module.ExtSplats({fileBytes: new Uint8Array(bytes), fileType: module.SplatFileType.SPLAT});
await splats.initialized;
splats.forEachSplat((i, center, scales, q) => seen.spark = [q.w, q.x, q.y, q.z]);
seen.gsplat = [...(await import('gsplat')).SplatData.Deserialize(new Uint8Array(bytes)).rotations];
const turn = q => 2 * Math.atan2(Math.hypot(q[1], q[2], q[3]), Math.abs(q[0])) * 180 / Math.PI;
for (const n in seen) console.log(n, seen[n], 'turned by', turn(seen[n]).toFixed(2), 'degrees');
const near = (a, b) => Math.abs(a - b) < 0.1;
process.exit(near(turn(seen['splat-transform']), 0.78) && near(turn(seen.spark), 14.33) && seen.gsplat[0] === 127 / 128 && turn(seen.gsplat) === 0 ? 0 : 1);
END
