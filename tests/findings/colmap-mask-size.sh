#!/bin/sh
# COLMAP 3.8 (Debian's colmap), feature_extractor: a mask of half the photograph's size, black in its left half and white in its right one, is
# laid on the photograph's upper left quarter, pixel by pixel, and all outside it counts as black. Of 400 x 300 pixels features are kept at x
# of 100 to 200 alone, so in the half that was to be left out, and no word is said. Its documentation (FAQ, "Mask image regions") has no
# features where the mask is black, and tells of the mask's name, not of its size. One would guess that the mask is scaled or refused: networks
# that segment work on small pictures. Photographs are made smaller here, too (max_image_size), and with that a mask of their full size agrees.
. "$(dirname "$0")/lib.sh"
debian colmap colmap 3.8
python3 - <<'END'
import os, sqlite3, struct, subprocess, sys, zlib
from files import picture
def png(path, w, h, value): # 8-bit grey
    picture(path, w, h, 8, 0, bytes(value(x, y) for y in range(h) for x in range(w)))
W, H = 400, 300
os.mkdir('photos'); os.mkdir('masks')
png('photos/a.png', W, H, lambda x, y: zlib.crc32(b'%d %d' % (x // 4, y // 4)) & 255) # blocks of noise
right = lambda w: lambda x, y: 255 * (x >= w // 2)
def features(*options):
    subprocess.run(['colmap', 'feature_extractor', '--database_path', 'found.db', '--image_path', 'photos',
        '--ImageReader.mask_path', 'masks', '--SiftExtraction.use_gpu', '0', *options], check=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=dict(os.environ, QT_QPA_PLATFORM='offscreen'))
    rows, columns, data = sqlite3.connect('found.db').execute('select rows, cols, data from keypoints').fetchone()
    os.remove('found.db')
    xs = [struct.unpack_from('<f', data, 4 * columns * i)[0] for i in range(rows)]
    return len(xs), min(xs), max(xs)
seen = []
smaller = ('--SiftExtraction.max_image_size', '200')
for name, width, options in (('a mask of 400 x 300', W, ()), ('the same, max_image_size 200', W, smaller), ('a mask of 200 x 150', W // 2, ())):
    png('masks/a.png.png', width, width * H // W, right(width))
    seen.append(features(*options))
    print(name + ', right half white: %d features, at x of %.1f to %.1f' % seen[-1])
sys.exit(not (all(s[0] > 50 for s in seen) and seen[0][1] >= 200 and seen[1][1] >= 200 and 99 < seen[2][1] and seen[2][2] <= 200))
END
