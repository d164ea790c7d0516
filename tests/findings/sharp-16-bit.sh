#!/bin/sh
# npm's sharp 0.34.4: sharp("in.png").png() writes a PNG of 16-bit RGB anew with 8 bits: each value is cut to its high byte, 0x12ff becomes
# 0x12, where the nearest is 0x13. gAMA 1 is dropped too, so that linear values of 8 bits are taken for sRGB. metadata() of the input says
# ushort, rgb16: the library knows. toColourspace("rgb16") keeps 16 bits, and the documentation of png() does say 8 bits for what is not
# told otherwise. One would still guess that a file written anew keeps its depth, or is at least rounded.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 2' HUP INT TERM
command -v python3 >/dev/null || { echo "apt-get install python3 is needed"; exit 2; }
for need in node npm; do command -v $need >/dev/null || { echo "apt-get install $need is needed"; exit 2; }; done
echo "node $(node --version); sharp@0.34.4"
npm install --silent --no-audit --no-fund --ignore-scripts --prefix "$work" sharp@0.34.4 >"$work/log" 2>&1 || { cat "$work/log"; echo "npm has none of these"; exit 2; }
cd "$work"
python3 - <<'END'
import struct, sys, zlib
def chunk(kind, data): return struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))
def png(path, colour, *values): # 1 x 1, 16 bits, linear
    open(path, 'wb').write(b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', struct.pack('>IIBBBBB', 1, 1, 16, colour, 0, 0, 0)) + chunk(b'gAMA', struct.pack('>I', 100000)) +
        chunk(b'IDAT', zlib.compress(b'\0' + struct.pack('>%dH' % len(values), *values))) + chunk(b'IEND', b''))
png('in.png', 2, 0x12ff, 0x1234, 0xffff)
END
cat >see.mjs <<'END'
import fs from 'node:fs';
import sharp from 'sharp';
const {depth, space} = await sharp('in.png').metadata();
await sharp('in.png').png().toFile('out.png');
await sharp('in.png').toColourspace('rgb16').png().toFile('asked.png');
const out = fs.readFileSync('out.png'), asked = fs.readFileSync('asked.png'), pixel = [...await sharp('out.png').raw().toBuffer()];
const seen = {in: [depth, space], bits: out[24], 'bits when asked': asked[24], gAMA: out.includes('gAMA'), pixel: pixel.map(v => v.toString(16)).join(' ')};
console.log(seen);
process.exit(depth === 'ushort' && out[24] === 8 && asked[24] === 16 && !seen.gAMA && seen.pixel === '12 12 ff' ? 0 : 1);
END
node see.mjs
