#!/bin/sh
# oiiotool 2.4.7.1 (Debian's openimageio-tools): a PNG with gAMA and Display P3's cHRM, written anew, keeps gAMA and loses cHRM. An OpenEXR
# file with P3's chromaticities becomes a PNG with gAMA 1, without cHRM. Yet the tool knows how to write cHRM: it gives sRGB's to a PNG that
# has none of these chunks. One would guess that primaries are kept, as gAMA is: without them strong colours are shown pale.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 2' HUP INT TERM
command -v python3 >/dev/null || { echo "apt-get install python3 is needed"; exit 2; }
command -v oiiotool >/dev/null || { echo "apt-get install openimageio-tools is needed"; exit 2; }
found=$(oiiotool --version 2>/dev/null | sed -n 's/^\(OpenImageIO \)*\([0-9.]*\).*/\2/p' | head -n 1)
echo "openimageio-tools $found, pinned 2.4.7.1"
[ "$found" = 2.4.7.1 ] || echo "another version than the pinned one"
cd "$work"
python3 - <<'END'
import struct, subprocess, sys, zlib
def chunk(kind, data): return struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))
def png(path, *extra): # 1 x 1, 16-bit RGB
    open(path, 'wb').write(b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', struct.pack('>IIBBBBB', 1, 1, 16, 2, 0, 0, 0)) + b''.join(chunk(*e) for e in extra) +
        chunk(b'IDAT', zlib.compress(b'\0' + struct.pack('>3H', 1000, 20000, 60000))) + chunk(b'IEND', b''))
def chunks(path):
    data, at, found = open(path, 'rb').read(), 8, {}
    while at < len(data):
        n, = struct.unpack('>I', data[at:at + 4])
        found[data[at + 4:at + 8].decode()] = data[at + 8:at + 8 + n]
        at += 12 + n
    return found
def colour(path): # what says how the values are to be understood
    return {kind: data.hex() if kind != 'iCCP' else 'a profile' for kind, data in chunks(path).items() if kind in ('gAMA', 'cHRM', 'sRGB', 'iCCP', 'cICP')}
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
png('in.png', (b'gAMA', struct.pack('>I', 45455)), (b'cHRM', struct.pack('>8I', 31270, 32900, 68000, 32000, 26500, 69000, 15000, 6000)))
png('bare.png')
exr('in.exr', RGB, primaries(*P3))
seen = {}
for name in ('in.png', 'bare.png', 'in.exr'):
    subprocess.run(['oiiotool', name, '-o', 'out.png'], check=True)
    seen[name] = colour('out.png')
    print(name, '->', seen[name])
sys.exit(not (set(seen['in.png']) == {'gAMA'} and 'cHRM' in seen['bare.png'] and seen['in.exr'] == {'gAMA': '%08x' % 100000}))
END
