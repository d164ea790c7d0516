#!/bin/sh
# COLMAP 3.8 (Debian's colmap), image_undistorter: a linear PNG (gAMA 1) taken by a camera that bends lines comes out raised to 1 / 2.2, in 8
# bits and without the chunk; one of the same bytes taken by a pinhole camera of the same model is copied as it is. One would guess that
# undistorting moves pixels and leaves their values, or at least treats the photographs of one model alike: here the two cameras' photographs
# of one wall, 0.25 in the files, are 0.25 and 0.53 afterwards.
. "$(dirname "$0")/lib.sh"
debian colmap colmap 3.8
python3 - <<'END'
import os, struct, subprocess, sys, zlib
from files import chunks, colour, picture
W, H = 64, 48
def wall(path): # 16-bit grey of 0.25, linear
    picture(path, W, H, 16, 2, struct.pack('>H', 16384) * 3 * W * H, (b'gAMA', struct.pack('>I', 100000)))
for folder in ('photos', 'model'): os.mkdir(folder)
for name in ('straight', 'bent'): wall('photos/%s.png' % name)
open('model/cameras.txt', 'w').write('1 PINHOLE 64 48 80 80 32 24\n2 SIMPLE_RADIAL 64 48 80 32 24 0.01\n')
open('model/images.txt', 'w').write('1 1 0 0 0 0 0 0 1 straight.png\n\n2 1 0 0 0 0 0 1 2 bent.png\n\n')
open('model/points3D.txt', 'w').close()
subprocess.run(['colmap', 'image_undistorter', '--image_path', 'photos', '--input_path', 'model', '--output_path', 'flat'], check=True,
    stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=dict(os.environ, QT_QPA_PLATFORM='offscreen'))
seen = {}
for name in ('straight', 'bent'):
    found = chunks('flat/images/%s.png' % name)
    depth, kind = found['IHDR'][8], found['IHDR'][9]
    row = zlib.decompress(found['IDAT'])[1:] # one grey: after the first pixel every filter's rest is known, the first is as it is
    value = (struct.unpack('>H', row[:2])[0] / 65535) if depth == 16 else row[0] / 255
    seen[name] = (depth, round(value, 2), colour('flat/images/%s.png' % name))
    print(name, '%d bits, %.2f' % seen[name][:2], seen[name][2])
same = open('photos/straight.png', 'rb').read() == open('flat/images/straight.png', 'rb').read()
sys.exit(not (same and seen['bent'] == (8, 0.53, {}) and seen['straight'][:2] == (16, 0.25)))
END
