#!/bin/sh
# COLMAP 3.8 (Debian's colmap), feature_extractor: of a photograph whose EXIF says 36 mm in FocalLengthIn35mmFilm, 360 x 240 pixels, it takes
# a focal length of 370.29 pixels as known. A frame of 35 mm film is 36 mm wide and 24 high, so that it is 360: COLMAP divides by 35, the
# width of the strip. EXIF defines the tag as the length that gives the same view on a camera of 35 mm film. So one would guess 360. As a first
# value 3 percent do not matter, but --Mapper.ba_refine_focal_length 0 is for lengths that are known, and keeps it.
. "$(dirname "$0")/lib.sh"
debian colmap colmap 3.8
python3 - <<'END'
import os, sqlite3, struct, subprocess, sys
W, H = 360, 240
grey = bytes((x * x + 3 * y * y >> 5) * 37 & 255 for y in range(H) for x in range(W)) # something to find
os.mkdir('photos')
at = 8 + W * H # of a TIFF: pixels, then the EXIF directory with one entry, then the main one
exif = struct.pack('<HHHIII', 1, 0xA405, 3, 1, 36, 0)
entries = ((256, 3, W), (257, 3, H), (258, 3, 8), (259, 3, 1), (262, 3, 1), (273, 4, 8), (277, 3, 1), (278, 4, H), (279, 4, W * H), (34665, 4, at))
main = struct.pack('<H', len(entries)) + b''.join(struct.pack('<HHII', tag, kind, 1, value) for tag, kind, value in entries) + bytes(4)
open('photos/a.tif', 'wb').write(b'II*\0' + struct.pack('<I', at + len(exif)) + grey + exif + main)
subprocess.run(['colmap', 'feature_extractor', '--database_path', 'found.db', '--image_path', 'photos', '--SiftExtraction.use_gpu', '0',
    '--ImageReader.camera_model', 'SIMPLE_PINHOLE'], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    env=dict(os.environ, QT_QPA_PLATFORM='offscreen'))
(width, height, parameters, known), = sqlite3.connect('found.db').execute('select width, height, params, prior_focal_length from cameras')
focal = struct.unpack('<3d', parameters)[0]
print('36 mm on film of 36 x 24 mm: %d x %d pixels, focal length %.2f, %s' % (width, height, focal, 'known' if known else 'guessed'))
sys.exit(not (known == 1 and abs(focal - 360 * 36 / 35) < 1e-6))
END
