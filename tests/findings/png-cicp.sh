#!/bin/sh
# oiiotool 2.4.7.1 (Debian's openimageio-tools) and ImageMagick 6.9.11-60 (Debian's imagemagick) do not know PNG's cICP chunk. Both write a
# PNG in PQ, BT.2020, anew with the same values and without cICP. That much is to be expected of programs that are older than the chunk. But
# both then add gAMA 0.45455 and sRGB's cHRM, oiiotool sRGB besides. One would guess that values of which nothing is known get no tag: an
# unsure file has become one that is surely wrong.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 2' HUP INT TERM
command -v python3 >/dev/null || { echo "apt-get install python3 is needed"; exit 2; }
command -v oiiotool >/dev/null || { echo "apt-get install openimageio-tools is needed"; exit 2; }
found=$(oiiotool --version 2>/dev/null | sed -n 's/^\(OpenImageIO \)*\([0-9.]*\).*/\2/p' | head -n 1)
echo "openimageio-tools $found, pinned 2.4.7.1"
[ "$found" = 2.4.7.1 ] || echo "another version than the pinned one"
command -v convert-im6.q16 >/dev/null || { echo "apt-get install imagemagick is needed"; exit 2; }
found=$(convert-im6.q16 --version | sed -n 's/^Version: ImageMagick \([-0-9.]*\).*/\1/p')
echo "imagemagick $found, pinned 6.9.11-60"
[ "$found" = 6.9.11-60 ] || echo "another version than the pinned one"
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
png('in.png', (b'cICP', bytes([9, 16, 0, 1])))
subprocess.run(['oiiotool', 'in.png', '-o', 'oiiotool.png'], check=True)
subprocess.run(['convert-im6.q16', 'in.png', 'convert.png'], check=True)
seen = {name: colour(name) for name in ('in.png', 'oiiotool.png', 'convert.png')}
for name in seen: print(name, seen[name])
srgb = lambda s: 'cICP' not in s and s.get('gAMA') == '%08x' % 45455 and s.get('cHRM', '')[:16] == '00007a2600008084'
same = all(zlib.decompress(chunks(name)['IDAT'])[1:] == struct.pack('>3H', 1000, 20000, 60000) for name in seen) # one pixel: no filter changes it
sys.exit(not (srgb(seen['oiiotool.png']) and 'sRGB' in seen['oiiotool.png'] and srgb(seen['convert.png']) and same))
END
