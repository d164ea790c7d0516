#!/bin/sh
# oiiotool 2.4.7.1 (Debian's openimageio-tools): a PNG with a linear ICC profile, written anew, keeps the profile and gets gAMA 0.45455 and
# sRGB's cHRM beside it. Two chunks then contradict each other. Who reads profiles sees linear values, who reads gAMA alone sees sRGB. The
# input has the profile alone, and nothing was asked to change. One would guess that either nothing is said besides, or what the profile
# says.
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
def profile(): # linear values, sRGB's primaries adapted to D50
    s15 = lambda *v: b''.join(struct.pack('>i', round(65536 * x)) for x in v)
    tags = {b'desc': b'desc' + struct.pack('>III', 0, 7, 0x6c696e65)[:12] + b'ar\0' + bytes(79), b'cprt': b'text\0\0\0\0none\0\0\0\0', b'wtpt': b'XYZ \0\0\0\0' + s15(.9642, 1, .8249),
        b'rXYZ': b'XYZ \0\0\0\0' + s15(.43607, .22249, .01392), b'gXYZ': b'XYZ \0\0\0\0' + s15(.38515, .71687, .09708), b'bXYZ': b'XYZ \0\0\0\0' + s15(.14307, .06061, .7141)}
    tags.update({c + b'TRC': b'curv' + bytes(8) for c in (b'r', b'g', b'b')})
    table, body = struct.pack('>I', len(tags)), b''
    for name, data in tags.items():
        table += name + struct.pack('>II', 128 + 4 + 12 * len(tags) + len(body), len(data))
        body += data + bytes(-len(data) % 4)
    head = struct.pack('>III', 128 + len(table) + len(body), 0, 0x02400000) + b'mntrRGB XYZ ' + struct.pack('>6H', 2024, 1, 1, 0, 0, 0) + b'acsp' + bytes(28) + s15(.9642, 1, .8249)
    return head.ljust(128, b'\0') + table + body
png('in.png', (b'iCCP', b'linear\0\0' + zlib.compress(profile())))
subprocess.run(['oiiotool', 'in.png', '-o', 'out.png'], check=True)
seen = colour('out.png')
print(colour('in.png'), '->', seen)
linear = zlib.decompress(chunks('out.png')['iCCP'].split(b'\0', 1)[1][1:]) == profile()
sys.exit(not (linear and seen.get('gAMA') == '%08x' % 45455 and seen.get('cHRM', '')[:16] == '00007a2600008084'))
END
