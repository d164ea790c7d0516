#!/bin/sh
# oiiotool 2.4.7.1 (Debian's openimageio-tools): an OpenEXR file with half R G B, float Z and a uint channel `id` is written anew with float
# channels alone, and id 16777217 is 0.00390625: it was divided by 2^32, as 8-bit values are by 255. OpenEXR gives every channel a type of
# its own, and uint is there for numbers of objects. One would guess that the types are kept, or that an id becomes at least the float
# nearest to it.
. "$(dirname "$0")/lib.sh"
debian oiiotool openimageio-tools 2.4.7.1
python3 - <<'END'
import struct, subprocess, sys
from files import RGB, exr, headers
exr('in.exr', RGB + [('Z', 2, 1.5), ('id', 0, 16777217)])
subprocess.run(['oiiotool', 'in.exr', '-o', 'out.exr'], check=True)
part = headers('out.exr')[0]
listed, types = part['channels'], {}
while listed != b'\0':
    name = listed[:listed.index(0)]
    types[name.decode()] = ('uint', 'half', 'float')[listed[len(name) + 1]]
    listed = listed[len(name) + 17:]
last, = struct.unpack('<f', open('out.exr', 'rb').read()[-4:]) # channels are in the order of their names
print(types, 'id', last)
sys.exit(not (part['compression'] == b'\0' and set(types.values()) == {'float'} and abs(last - 16777217 / 2 ** 32) < 1e-8))
END
