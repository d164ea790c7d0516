#!/bin/sh
# exrmultipart of OpenEXR 3.1.5 (Debian's openexr): -combine accepts a part in Display P3 followed by one without chromaticities; the same
# two files the other way round are a conflict, and refused. With -override 1 the second order is written, and the P3 part has no
# chromaticities any more, its pixels as they were: what was P3 is now taken for BT.709. One would guess that a conflict does not depend on
# the order, and that overriding puts what is said in place of what is unsaid.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 2' HUP INT TERM
command -v python3 >/dev/null || { echo "apt-get install python3 is needed"; exit 2; }
command -v exrmultiview >/dev/null || { echo "apt-get install openexr is needed"; exit 2; }
found=$(dpkg-query -W -f '${Version}' openexr 2>/dev/null | sed 's/-.*//')
echo "openexr $found, pinned 3.1.5"
[ "$found" = 3.1.5 ] || echo "another version than the pinned one"
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
exr('p3.exr', RGB, primaries(*P3))
exr('bare.exr', RGB)
def combine(*words):
    done = subprocess.run(['exrmultipart', '-combine', '-i', *words[:2], '-o', 'out.exr', '-override', words[2]], stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    text = done.stdout.decode()
    seen = [said(part) for part in headers('out.exr')] if done.returncode == 0 else [line for line in text.splitlines() if 'ERROR' in line]
    print(*words, '->', seen)
    return seen
p3 = [round(v, 3) for v in P3]
first, second, third = combine('p3.exr', 'bare.exr', '0'), combine('bare.exr', 'p3.exr', '0'), combine('bare.exr', 'p3.exr', '1')
sys.exit(not (first == [p3, None] and 'Conflicting attributes' in second[0] and third == [None, None]))
END
