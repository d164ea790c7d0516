#!/bin/sh
# exrmultipart of OpenEXR 3.1.5 (Debian's openexr): -combine accepts a part in Display P3 followed by one without chromaticities; the same
# two files the other way round are a conflict, and refused. With -override 1 the second order is written, and the P3 part has no
# chromaticities any more, its pixels as they were: what was P3 is now taken for BT.709. One would guess that a conflict does not depend on
# the order, and that overriding puts what is said in place of what is unsaid.
. "$(dirname "$0")/lib.sh"
debian exrmultipart openexr 3.1.5
python3 - <<'END'
import subprocess, sys
from files import P3, RGB, exr, headers, said
exr('p3.exr', RGB, P3)
exr('bare.exr', RGB)
def combine(*words):
    done = subprocess.run(['exrmultipart', '-combine', '-i', *words[:2], '-o', 'out.exr', '-override', words[2]], stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    text = done.stdout.decode()
    seen = [said(part) for part in headers('out.exr')] if done.returncode == 0 else [line for line in text.splitlines() if 'ERROR' in line]
    print(*words, '->', seen)
    return seen
first, second, third = combine('p3.exr', 'bare.exr', '0'), combine('bare.exr', 'p3.exr', '0'), combine('bare.exr', 'p3.exr', '1')
sys.exit(not (first == [P3, None] and 'Conflicting attributes' in second[0] and third == [None, None]))
END
