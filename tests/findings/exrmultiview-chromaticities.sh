#!/bin/sh
# exrmultiview of OpenEXR 3.1.5 (Debian's openexr): it combines a view in Display P3 and one in BT.2020 without a word. The result has one
# chromaticities attribute for both, that of the last file, and the pixels of both as they were: the first view, the default one, is now
# read as BT.2020. The same package's exrmultipart refuses two such files. One would guess that exrmultiview refuses, converts, or keeps
# what the default view says.
. "$(dirname "$0")/lib.sh"
debian exrmultiview openexr 3.1.5
python3 - <<'END'
import struct, subprocess, sys
from files import P3, RGB, exr, headers, said
BT2020 = .708, .292, .17, .797, .131, .046, .3127, .329
exr('p3.exr', RGB, P3)
exr('bt2020.exr', RGB, BT2020)
seen = []
for order in (('p3.exr', 'bt2020.exr'), ('bt2020.exr', 'p3.exr')):
    done = subprocess.run(['exrmultiview', '-z', 'none', 'left', order[0], 'right', order[1], 'out.exr'], check=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    part = headers('out.exr')[0]
    seen.append(said(part))
    pixels = [v for v, in struct.iter_unpack('<e', open('out.exr', 'rb').read()[-12:])]
    print('left', order[0], 'right', order[1], '->', seen[-1], pixels, done.stdout.decode())
    same = pixels == [.25, .5, .75] * 2 and not done.stdout
refused = subprocess.run(['exrmultipart', '-combine', '-i', 'p3.exr', 'bt2020.exr', '-o', 'parts.exr'], stdout=subprocess.DEVNULL, stderr=subprocess.STDOUT).returncode
sys.exit(not (seen == [BT2020, P3] and same and refused))
END
