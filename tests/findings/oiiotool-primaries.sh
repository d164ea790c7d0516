#!/bin/sh
# oiiotool 2.4.7.1 (Debian's openimageio-tools): a PNG with gAMA and Display P3's cHRM, written anew, keeps gAMA and loses cHRM. An OpenEXR
# file with P3's chromaticities becomes a PNG with gAMA 1, without cHRM. Yet the tool knows how to write cHRM: it gives sRGB's to a PNG that
# has none of these chunks. One would guess that primaries are kept, as gAMA is: without them strong colours are shown pale.
. "$(dirname "$0")/lib.sh"
debian oiiotool openimageio-tools 2.4.7.1
python3 - <<'END'
import struct, subprocess, sys
from files import P3, RGB, colour, exr, png
png('in.png', (b'gAMA', struct.pack('>I', 45455)), (b'cHRM', struct.pack('>8I', 31270, 32900, 68000, 32000, 26500, 69000, 15000, 6000)))
png('bare.png')
exr('in.exr', RGB, P3)
seen = {}
for name in ('in.png', 'bare.png', 'in.exr'):
    subprocess.run(['oiiotool', name, '-o', 'out.png'], check=True)
    seen[name] = colour('out.png')
    print(name, '->', seen[name])
sys.exit(not (set(seen['in.png']) == {'gAMA'} and 'cHRM' in seen['bare.png'] and seen['in.exr'] == {'gAMA': '%08x' % 100000}))
END
