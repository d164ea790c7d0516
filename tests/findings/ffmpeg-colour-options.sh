#!/bin/sh
# ffmpeg 5.1.9 (Debian's ffmpeg): -color_trc linear -color_primaries bt2020 in front of a PNG to be written does nothing: the file has no
# gAMA, no cHRM, no cICP, and no warning is shown. -color_trc smpte2084 is as silent. The encoder can: -vf
# setparams=color_trc=linear:color_primaries=bt2020 gives gAMA 1 and cHRM. The options are general ones of video encoders. One would guess
# that they work here, or that one is told.
. "$(dirname "$0")/lib.sh"
debian ffmpeg ffmpeg 5.1.9
python3 - <<'END'
import subprocess, sys
from files import colour, png
png('in.png')
def seen(*words):
    done = subprocess.run(['ffmpeg', '-v', 'warning', '-y', '-i', 'in.png', *words, '-update', '1', '-frames:v', '1', 'out.png'], check=True, stderr=subprocess.PIPE, stdin=subprocess.DEVNULL)
    tags = colour('out.png')
    print(*words, '->', tags, done.stderr.decode().strip())
    return tags, 'color' in done.stderr.decode()
linear = seen('-color_trc', 'linear', '-color_primaries', 'bt2020')
pq = seen('-color_trc', 'smpte2084', '-color_primaries', 'bt2020')
filtered = seen('-vf', 'setparams=color_trc=linear:color_primaries=bt2020')[0]
sys.exit(not (linear == ({}, False) and pq == ({}, False) and filtered.get('gAMA') == '%08x' % 100000 and 'cHRM' in filtered))
END
