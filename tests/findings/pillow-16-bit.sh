#!/bin/sh
# Pillow 9.4.0 (Debian's python3-pil): a PNG of 16-bit RGB is opened as 8-bit RGB without a word, each value cut to its high byte: 0x12ff
# becomes 0x12, where the nearest is 0x13. A PNG of 16-bit grey keeps its values, but convert("L") clips them at 255: 0x1234 becomes white,
# where colour becomes 0x12. Splat trainers open their photographs with Pillow, and the file says 16 bits. One would guess that 16 bits
# stay, or that both kinds are scaled alike.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 2' HUP INT TERM
command -v /usr/bin/python3 >/dev/null || { echo "apt-get install python3-pil is needed"; exit 2; }
found=$(/usr/bin/python3 -c 'import PIL; print(PIL.__version__)' 2>/dev/null || echo none)
echo "python3-pil $found, pinned 9.4.0"
[ "$found" = 9.4.0 ] || echo "another version than the pinned one"
[ "$found" != none ] || { echo "apt-get install python3-pil is needed"; exit 2; }
cd "$work"
/usr/bin/python3 - <<'END'
import struct, sys, zlib
def chunk(kind, data): return struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))
def png(path, colour, *values): # 1 x 1, 16 bits, linear
    open(path, 'wb').write(b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', struct.pack('>IIBBBBB', 1, 1, 16, colour, 0, 0, 0)) + chunk(b'gAMA', struct.pack('>I', 100000)) +
        chunk(b'IDAT', zlib.compress(b'\0' + struct.pack('>%dH' % len(values), *values))) + chunk(b'IEND', b''))
from PIL import Image
png('colour.png', 2, 0x12ff, 0x1234, 0xffff)
png('grey.png', 0, 0x1234)
colour, grey = Image.open('colour.png'), Image.open('grey.png')
seen = colour.mode, colour.getpixel((0, 0)), grey.mode, grey.getpixel((0, 0)), grey.convert('L').getpixel((0, 0))
print(*seen)
sys.exit(not (seen == ('RGB', (0x12, 0x12, 0xff), 'I', 0x1234, 255)))
END
