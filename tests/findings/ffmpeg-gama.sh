#!/bin/sh
# ffmpeg 5.1.9 (Debian's ffmpeg): a PNG with an ICC profile keeps it when it is written anew; one with gAMA 1 (linear) and cHRM loses both.
# Its encoder can write both. The values are the same, so a linear picture has become one without a tag, which is taken for sRGB. One would
# guess that a program which carries the harder of PNG's two ways to say it carries the easier one as well.
. "$(dirname "$0")/lib.sh"
debian ffmpeg ffmpeg 5.1.9
python3 - <<'END'
import struct, subprocess, sys, zlib
from files import colour, png, profile
png('profile.png', (b'iCCP', b'linear\0\0' + zlib.compress(profile())))
png('gamma.png', (b'gAMA', struct.pack('>I', 100000)), (b'cHRM', struct.pack('>8I', 31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000)))
seen = {}
for name in ('profile.png', 'gamma.png'):
    subprocess.run(['ffmpeg', '-v', 'error', '-y', '-i', name, 'out.png'], check=True, stdin=subprocess.DEVNULL)
    seen[name] = colour('out.png')
    print(name, colour(name), '->', seen[name])
sys.exit(not (seen == {'profile.png': {'iCCP': 'a profile'}, 'gamma.png': {}}))
END
