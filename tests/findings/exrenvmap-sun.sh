#!/bin/sh
# exrenvmap 3.1.5 (Debian's openexr), OpenEXR's tool that turns maps of the surroundings to cubes and back: it reads and writes half floats
# alone, whatever the file has, and does not say so. A float map with one pixel of 100000, a sun, gets infinite where the sun's filtered
# picture lies, and where filters weigh it with 0 it gets NaN. A sun of 60000 is as it should be. Its usage says nothing of types; the sun
# outshines the largest half, 65504, in maps that are measured. One would guess that a tool of OpenEXR keeps the type of OpenEXR's channels.
. "$(dirname "$0")/lib.sh"
debian exrenvmap openexr 3.1.5
need oiiotool openimageio-tools
python3 - <<'END'
import re, subprocess, sys
from files import exr
def sky(path, sun): # 1, and one pixel of the sun
    exr(path, [(c, 2, lambda x, y: sun if (x, y) == (20, 8) else 1) for c in 'BGR'], w=64, h=32)
seen = {}
for sun in (60000, 100000):
    sky('sky.exr', sun)
    for to, width in (('-c', 32), ('-l', 64)):
        subprocess.run(['exrenvmap', to, '-w', str(width), 'sky.exr', 'out.exr'], check=True)
        said = subprocess.run(['oiiotool', '--stats', 'out.exr'], check=True, capture_output=True, text=True).stdout
        kind = subprocess.run(['oiiotool', '--info', 'out.exr'], check=True, capture_output=True, text=True).stdout.split()
        seen[sun, to] = [int(re.search(what + r'Count: (\d+)', said).group(1)) for what in ('Inf', 'Nan')] + ['half' in kind]
        infinite, nan, half = seen[sun, to]
        print('a sun of', sun, {'-c': 'to a cube:', '-l': 'to a map:'}[to], infinite, 'infinite,', nan, 'NaN,', 'half' if half else 'another type')
sys.exit(not (all(s[2] for s in seen.values()) and all(seen[60000, t][:2] == [0, 0] for t in ('-c', '-l')) and
    seen[100000, '-c'][0] > 0 and seen[100000, '-l'][0] > 0 and seen[100000, '-l'][1] > 0))
END
