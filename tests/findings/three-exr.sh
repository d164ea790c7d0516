#!/bin/sh
# EXRLoader of npm's three 0.187.0: it reads the chromaticities of an OpenEXR file in Display P3, leaves the pixels as they are, and calls
# the texture srgb-linear. three converts pictures of other spaces where a texture says so. And of a 4 x 3 display window that the data
# window covers in part it gives the data window alone: a picture of 1 x 1, where the PNG of the same frame would have 4 x 3. One would
# guess that colours are converted or named, and that the frame has its size.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 2' HUP INT TERM
command -v python3 >/dev/null || { echo "apt-get install python3 is needed"; exit 2; }
for need in node npm; do command -v $need >/dev/null || { echo "apt-get install $need is needed"; exit 2; }; done
echo "node $(node --version); three@0.187.0"
npm install --silent --no-audit --no-fund --ignore-scripts --prefix "$work" three@0.187.0 >"$work/log" 2>&1 || { cat "$work/log"; echo "npm has none of these"; exit 2; }
cd "$work"
python3 - <<'END'
import os, struct, subprocess, sys
def attribute(name, kind, data): return name.encode() + b'\0' + kind.encode() + b'\0' + struct.pack('<i', len(data)) + data
def exr(path, channels, more=b'', width=1, data=(0, 0), display=None): # channels: name, type (0 uint, 1 half, 2 float), value; one line
    x, y = data
    listed = b''.join(n.encode() + b'\0' + struct.pack('<iB3xii', t, 0, 1, 1) for n, t, v in channels) + b'\0'
    row = b''.join(struct.pack('<' + 'Ief'[t], v) * width for n, t, v in channels)
    head = b'\x76\x2f\x31\x01\2\0\0\0' + attribute('channels', 'chlist', listed) + attribute('compression', 'compression', b'\0') + \
        attribute('dataWindow', 'box2i', struct.pack('<4i', x, y, x + width - 1, y)) + attribute('displayWindow', 'box2i', struct.pack('<4i', *(display or (x, y, x + width - 1, y)))) + \
        attribute('lineOrder', 'lineOrder', b'\0') + attribute('pixelAspectRatio', 'float', struct.pack('<f', 1)) + \
        attribute('screenWindowCenter', 'v2f', bytes(8)) + attribute('screenWindowWidth', 'float', struct.pack('<f', 1)) + more + b'\0'
    open(path, 'wb').write(head + struct.pack('<Q', len(head) + 8) + struct.pack('<ii', y, len(row)) + row)
def headers(path): # the attributes of each part
    f = open(path, 'rb').read()
    multi, at, parts = f[5] & 0x10, 8, []
    while f[at]:
        part = {}
        while f[at]:
            name = f[at:f.index(0, at)]; at += len(name) + 1
            kind = f[at:f.index(0, at)]; at += len(kind) + 1
            n, = struct.unpack('<i', f[at:at + 4])
            part[name.decode()] = f[at + 4:at + 4 + n]
            at += 4 + n
        parts.append(part)
        at += 1
        if not multi: break
    return parts
def primaries(*xy): return attribute('chromaticities', 'chromaticities', struct.pack('<8f', *xy))
def said(part): return [round(v, 3) for v in struct.unpack('<8f', part['chromaticities'])] if 'chromaticities' in part else None
P3 = .68, .32, .265, .69, .15, .06, .3127, .329
BT2020 = .708, .292, .17, .797, .131, .046, .3127, .329
RGB = [('B', 1, .25), ('G', 1, .5), ('R', 1, .75)]
exr('in.exr', RGB, primaries(*P3), data=(2, 1), display=(0, 0, 3, 2))
END
cat >see.mjs <<'END'
import fs from 'node:fs';
import { DataUtils } from 'three';
import { EXRLoader } from 'three/examples/jsm/loaders/EXRLoader.js';
const t = new EXRLoader().parse(new Uint8Array(fs.readFileSync('in.exr')).buffer), pixel = [...t.data].map(DataUtils.fromHalfFloat);
console.log(t.width, 'x', t.height, t.colorSpace, pixel, t.header.chromaticities);
process.exit(t.width === 1 && t.height === 1 && t.colorSpace === 'srgb-linear' && pixel.join() === '0.75,0.5,0.25,1' && Math.abs(t.header.chromaticities.redX - 0.68) < 1e-5 ? 0 : 1);
END
node see.mjs
