#!/bin/sh
# oiiotool 2.4.7.1 (Debian's openimageio-tools) and ImageMagick 6.9.11-60 (Debian's imagemagick) do not know PNG's cICP chunk. Both write a
# PNG in PQ, BT.2020, anew with the same values and without cICP. That much is to be expected of programs that are older than the chunk. But
# both then add gAMA 0.45455 and sRGB's cHRM, oiiotool sRGB besides. One would guess that values of which nothing is known get no tag: an
# unsure file has become one that is surely wrong.
. "$(dirname "$0")/lib.sh"
debian oiiotool openimageio-tools 2.4.7.1
debian convert-im6.q16 imagemagick 6.9.11.60
python3 - <<'END'
import struct, subprocess, sys, zlib
from files import chunks, colour, png
png('in.png', (b'cICP', bytes([9, 16, 0, 1])))
subprocess.run(['oiiotool', 'in.png', '-o', 'oiiotool.png'], check=True)
subprocess.run(['convert-im6.q16', 'in.png', 'convert.png'], check=True)
seen = {name: colour(name) for name in ('in.png', 'oiiotool.png', 'convert.png')}
for name in seen: print(name, seen[name])
srgb = lambda s: 'cICP' not in s and s.get('gAMA') == '%08x' % 45455 and s.get('cHRM', '')[:16] == '00007a2600008084'
same = all(zlib.decompress(chunks(name)['IDAT'])[1:] == struct.pack('>3H', 1000, 20000, 60000) for name in seen) # one pixel: no filter changes it
sys.exit(not (srgb(seen['oiiotool.png']) and 'sRGB' in seen['oiiotool.png'] and srgb(seen['convert.png']) and same))
END
