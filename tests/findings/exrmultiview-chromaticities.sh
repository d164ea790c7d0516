#!/bin/sh
# exrmultiview of OpenEXR 3.1.5 (Debian's openexr): it combines a view in Display P3 and one in BT.2020 without a word. The result has one
# chromaticities attribute for both, that of the last file, and the pixels of both as they were: the first view, the default one, is now
# read as BT.2020. The same package's exrmultipart refuses two such files. One would guess that exrmultiview refuses, converts, or keeps
# what the default view says.
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
exr('bt2020.exr', RGB, primaries(*BT2020))
seen = []
for order in (('p3.exr', 'bt2020.exr'), ('bt2020.exr', 'p3.exr')):
    done = subprocess.run(['exrmultiview', '-z', 'none', 'left', order[0], 'right', order[1], 'out.exr'], check=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    part = headers('out.exr')[0]
    seen.append(said(part))
    pixels = [v for v, in struct.iter_unpack('<e', open('out.exr', 'rb').read()[-12:])]
    print('left', order[0], 'right', order[1], '->', seen[-1], pixels, done.stdout.decode())
    same = pixels == [.25, .5, .75] * 2 and not done.stdout
refused = subprocess.run(['exrmultipart', '-combine', '-i', 'p3.exr', 'bt2020.exr', '-o', 'parts.exr'], stdout=subprocess.DEVNULL, stderr=subprocess.STDOUT).returncode
sys.exit(not (seen == [[round(v, 3) for v in xy] for xy in (BT2020, P3)] and same and refused))
END
