#!/bin/sh
# idiff and oiiotool --diff 2.4.7.1 (Debian's openimageio-tools): an OpenEXR file whose pixels are 1 and one whose pixels are NaN compare as
# PASS, exit status 0, and so do +infinity and -infinity. 1 and infinity fail, as 1 and 1.1 do. The help says that differences above a
# threshold of 1e-06 fail. One would guess that NaN, which equals nothing, fails as infinity does: a test of a renderer that compares its
# pictures with known good ones passes the day it renders nothing but NaN.
. "$(dirname "$0")/lib.sh"
debian idiff openimageio-tools 2.4.7.1
python3 - <<'END'
import subprocess, sys
from files import exr
values = {'one': 1, 'other': 1.1, 'nan': float('nan'), 'inf': float('inf'), 'minus-inf': -float('inf')}
for name, v in values.items(): exr(name + '.exr', [(c, 2, v) for c in 'BGR'])
right = True
for a, b, passes in (('one', 'nan', True), ('nan', 'one', True), ('inf', 'minus-inf', True), ('one', 'inf', False), ('one', 'other', False)):
    seen = [subprocess.run(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL).returncode == 0
        for words in (['idiff', a + '.exr', b + '.exr'], ['oiiotool', a + '.exr', b + '.exr', '--diff'])]
    print(a, 'and', b, '-> idiff, oiiotool --diff:', *('PASS' if s else 'FAILURE' for s in seen))
    right = right and seen == [passes, passes]
sys.exit(not right)
END
