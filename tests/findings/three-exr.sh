#!/bin/sh
# EXRLoader of npm's three 0.187.0: it reads the chromaticities of an OpenEXR file in Display P3, leaves the pixels as they are, and calls
# the texture srgb-linear. three converts pictures of other spaces where a texture says so. And of a 4 x 3 display window that the data
# window covers in part it gives the data window alone: a picture of 1 x 1, where the PNG of the same frame would have 4 x 3. One would
# guess that colours are converted or named, and that the frame has its size.
. "$(dirname "$0")/lib.sh"
need python3 python3
packages three@0.187.0
python3 -c "from files import P3, RGB, exr; exr('in.exr', RGB, P3)"
node --input-type=module - <<'END'
import fs from 'node:fs';
import { DataUtils } from 'three';
import { EXRLoader } from 'three/examples/jsm/loaders/EXRLoader.js';
const file = new Uint8Array(fs.readFileSync('in.exr')), view = new DataView(file.buffer), text = Buffer.from(file).toString('latin1');
const window = (name, ...box) => box.forEach((v, i) => view.setInt32(text.indexOf(name) + name.length + 11 + 4 * i, v, true)); // 11: type and size
window('dataWindow', 2, 1, 2, 1);
window('displayWindow', 0, 0, 3, 2);
view.setInt32(file.length - 14, 1, true); // the line's y, in front of its length and three halves
const t = new EXRLoader().parse(file.buffer), pixel = [...t.data].map(DataUtils.fromHalfFloat);
console.log(t.width, 'x', t.height, t.colorSpace, pixel, t.header.chromaticities);
process.exit(t.width === 1 && t.height === 1 && t.colorSpace === 'srgb-linear' && pixel.join() === '0.75,0.5,0.25,1' && Math.abs(t.header.chromaticities.redX - 0.68) < 1e-5 ? 0 : 1);
END
