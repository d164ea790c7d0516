#!/bin/sh
# COLMAP 3.8 (Debian's colmap), feature_extractor on the CPU: `--SiftExtraction.max_num_features N` does not cap. It drops the finest scales as
# whole levels while N or more features are left, so nearly twice N may come out. One would guess from the name, and from the manual's
# "maximum number of features to detect", that N is the most: matching takes the square of it.
. "$(dirname "$0")/lib.sh"
debian colmap colmap 3.8
python3 - <<'END'
import math, os, random, sqlite3, subprocess, sys
from files import picture
W, H = 640, 480
draw, light = random.Random(1), [128.] * (W * H)
for blob in range(1500): # of six sizes
    r, x0, y0, high = draw.choice([2, 3, 4, 6, 9, 14]), draw.randrange(W), draw.randrange(H), draw.uniform(-90, 90)
    for y in range(max(0, y0 - 3 * r), min(H, y0 + 3 * r)):
        for x in range(max(0, x0 - 3 * r), min(W, x0 + 3 * r)):
            light[y * W + x] += high * math.exp(-((x - x0) ** 2 + (y - y0) ** 2) / (2 * r * r))
os.mkdir('photos')
picture('photos/blobs.png', W, H, 8, 0, bytes(max(0, min(255, int(v))) for v in light))
def features(name, *options):
    subprocess.run(['colmap', 'feature_extractor', '--database_path', name, '--image_path', 'photos', '--SiftExtraction.use_gpu', '0', *options], check=True,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=dict(os.environ, QT_QPA_PLATFORM='offscreen'))
    return sqlite3.connect(name).execute('select rows from keypoints').fetchone()[0]
free = features('free')
print(f'with the default of 8192: {free}')
over = []
for most in 100, 200, 400, 800:
    found = features(str(most), '--SiftExtraction.max_num_features', str(most))
    print(f'max_num_features {most}: {found}')
    over.append(most < found < free)
sys.exit(not all(over))
END
