#!/bin/sh
# oiiotool 2.4.7.1 (Debian's openimageio-tools): an OpenEXR file with half R G B, float Z and a uint channel `id` is written anew with float
# channels alone, and id 16777217 is 0.00390625: it was divided by 2^32, as 8-bit values are by 255. OpenEXR gives every channel a type of
# its own, and uint is there for numbers of objects. One would guess that the types are kept, or that an id becomes at least the float
# nearest to it.
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
exr('in.exr', RGB + [('Z', 2, 1.5), ('id', 0, 16777217)])
subprocess.run(['oiiotool', 'in.exr', '-o', 'out.exr'], check=True)
part = headers('out.exr')[0]
listed, types = part['channels'], {}
while listed != b'\0':
    name = listed[:listed.index(0)]
    types[name.decode()] = ('uint', 'half', 'float')[listed[len(name) + 1]]
    listed = listed[len(name) + 17:]
last, = struct.unpack('<f', open('out.exr', 'rb').read()[-4:]) # channels are in the order of their names
print(types, 'id', last)
sys.exit(not (part['compression'] == b'\0' and set(types.values()) == {'float'} and abs(last - 16777217 / 2 ** 32) < 1e-8))
END
