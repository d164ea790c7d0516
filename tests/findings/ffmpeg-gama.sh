#!/bin/sh
# ffmpeg 5.1.9 (Debian's ffmpeg): a PNG with an ICC profile keeps it when it is written anew; one with gAMA 1 (linear) and cHRM loses both.
# Its encoder can write both. The values are the same, so a linear picture has become one without a tag, which is taken for sRGB. One would
# guess that a program which carries the harder of PNG's two ways to say it carries the easier one as well.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 2' HUP INT TERM
command -v python3 >/dev/null || { echo "apt-get install python3 is needed"; exit 2; }
command -v ffmpeg >/dev/null || { echo "apt-get install ffmpeg is needed"; exit 2; }
found=$(ffmpeg -version | sed -n 's/^ffmpeg version \([0-9.]*\).*/\1/p')
echo "ffmpeg $found, pinned 5.1.9"
[ "$found" = 5.1.9 ] || echo "another version than the pinned one"
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
png('profile.png', (b'iCCP', b'linear\0\0' + zlib.compress(profile())))
png('gamma.png', (b'gAMA', struct.pack('>I', 100000)), (b'cHRM', struct.pack('>8I', 31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000)))
seen = {}
for name in ('profile.png', 'gamma.png'):
    subprocess.run(['ffmpeg', '-v', 'error', '-y', '-i', name, 'out.png'], check=True, stdin=subprocess.DEVNULL)
    seen[name] = colour('out.png')
    print(name, colour(name), '->', seen[name])
sys.exit(not (seen == {'profile.png': {'iCCP': 'a profile'}, 'gamma.png': {}}))
END
