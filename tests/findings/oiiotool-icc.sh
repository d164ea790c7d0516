#!/bin/sh
# oiiotool 2.4.7.1 (Debian's openimageio-tools): a PNG with a linear ICC profile, written anew, keeps the profile and gets gAMA 0.45455 and
# sRGB's cHRM beside it. Two chunks then contradict each other. Who reads profiles sees linear values, who reads gAMA alone sees sRGB. The
# input has the profile alone, and nothing was asked to change. One would guess that either nothing is said besides, or what the profile
# says.
. "$(dirname "$0")/lib.sh"
debian oiiotool openimageio-tools 2.4.7.1
python3 - <<'END'
import subprocess, sys, zlib
from files import chunks, colour, png, profile
png('in.png', (b'iCCP', b'linear\0\0' + zlib.compress(profile())))
subprocess.run(['oiiotool', 'in.png', '-o', 'out.png'], check=True)
seen = colour('out.png')
print(colour('in.png'), '->', seen)
linear = zlib.decompress(chunks('out.png')['iCCP'].split(b'\0', 1)[1][1:]) == profile()
sys.exit(not (linear and seen.get('gAMA') == '%08x' % 45455 and seen.get('cHRM', '')[:16] == '00007a2600008084'))
END
