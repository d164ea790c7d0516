#!/bin/sh
# npm's sharp 0.35.5: 16-bit numbers given as raw and taken as raw({depth: 'ushort'}), with nothing done to them, come out divided by 256:
# 1000 20000 60000 is 3 78 234, in 16 bits each. So does a 16-bit PNG, which metadata() calls ushort, and so does its alpha by raw()'s own
# example in the documentation, said to give "unsigned 16-bit pixel data": 40000 is 155. Floats of 0 to 1 are 0. toColourspace('rgb16') in
# front of raw() keeps the 16 bits. One would guess that depth says how deep: the type is as asked, and what is lost shows nowhere.
. "$(dirname "$0")/lib.sh"
packages sharp@0.35.5
node --input-type=module - <<'END'
import sharp from 'sharp';
const pixel = n => ({raw: {width: 1, height: 1, channels: n}});
const words = bytes => [...new Uint16Array(new Uint8Array(bytes).buffer)].join(' ');
const deep = Uint16Array.of(1000, 20000, 60000, 40000), png = await sharp(deep, pixel(4)).toColourspace('rgb16').png().toBuffer();
const ushort = {depth: 'ushort'}, floats = await sharp(Float32Array.of(0.1, 0.5, 0.9), pixel(3)).raw({depth: 'float'}).toBuffer();
const seen = {
    'the 16-bit PNG says': (await sharp(png).metadata()).depth,
    'raw to raw': words(await sharp(deep, pixel(4)).raw(ushort).toBuffer()),
    'PNG to raw': words(await sharp(png).raw(ushort).toBuffer()),
    'PNG, alpha by the example': words(await sharp(png).ensureAlpha().extractChannel(3).toColourspace('b-w').raw(ushort).toBuffer()),
    "PNG, 'rgb16', to raw": words(await sharp(png).toColourspace('rgb16').raw(ushort).toBuffer()),
    'floats 0.1 0.5 0.9 to raw': [...new Float32Array(new Uint8Array(floats).buffer)].join(' '),
};
for (const n in seen) console.log(n + ':', seen[n]);
process.exit(Object.values(seen).join() === 'ushort,3 78 234 156,3 78 234 156,155,1000 20000 60000 40000,0 0 0' ? 0 : 1);
END
