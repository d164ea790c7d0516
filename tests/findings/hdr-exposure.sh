#!/bin/sh
# Radiance's pictures, .hdr: a header's EXPOSURE is what the values were multiplied by; Radiance's reference ("File Formats", pictures) says to
# divide by it. Of 1 with EXPOSURE=4, pfsin 2.2.0 gives 0.25; oiiotool 2.4.7.1, vips 8.14.1 and npm's three 0.187.0 give 1 as without. And 1,
# stored as 128 128 128 129, is 1.0039 in vips, which adds half a step (its code for this is Radiance's), and in three, which divides by 255
# where the others divide by 256. Lines from the bottom up, +Y, are no error in pfsin, oiiotool and vips: the picture is upside down. One would
# guess that measured light is the same everywhere: pfilt writes EXPOSURE into what it has scaled, and a map of the sky is wrong by that factor.
. "$(dirname "$0")/lib.sh"
debian pfsin pfstools 2.2.0
debian oiiotool openimageio-tools 2.4.7.1
debian vips libvips-tools 8.14.1
packages three@0.187.0
cat >three.mjs <<'END'
import fs from 'node:fs';
import { FloatType } from 'three';
import { HDRLoader } from 'three/examples/jsm/loaders/HDRLoader.js';
const {data} = new HDRLoader().setDataType(FloatType).parse(new Uint8Array(fs.readFileSync('in.hdr')).buffer);
console.log(data[0], data[4]);
END
python3 - <<'END'
import re, struct, subprocess, sys
def run(*words): return subprocess.run(words, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout
readers = { # the upper value and the lower one of in.hdr
    'pfsin': lambda: struct.unpack('<6f', run('sh', '-c', 'pfsin in.hdr | pfsout out.pfm; tail -c 24 out.pfm'))[3::-3], # PFM: from the bottom up
    'oiiotool': lambda: [float(re.search(rb'Avg: (\S+)', run('oiiotool', 'in.hdr', '--cut', '1x1+0+' + y, '--printstats')).group(1)) for y in '01'],
    'vips': lambda: [run('vips', 'rad2float', 'in.hdr', 'out.v'), *(float(run('vips', 'getpoint', 'out.v', '0', y).split()[0]) for y in '01')][1:],
    'three': lambda: [float(v) for v in run('node', 'three.mjs').split()],
}
seen = {}
for name, read in readers.items():
    for header, lines in ((b'', b'-Y'), (b'EXPOSURE=4\n', b'-Y'), (b'', b'+Y')):
        pixels = bytes([128, 128, 128, 129, 128, 128, 128, 130]) # 1, 2
        open('in.hdr', 'wb').write(b'#?RADIANCE\n' + header + b'FORMAT=32-bit_rle_rgbe\n\n' + lines + b' 2 +X 1\n' + pixels)
        try: value = tuple(round(v, 3) for v in read())
        except subprocess.CalledProcessError: value = 'refused'
        seen[name, header, lines] = value
        print(name, (header or b'no EXPOSURE').decode().strip(), lines.decode(), '->', value)
more = 1.004, 2.008
expected = {'pfsin': ((1, 2), (.25, .5), (1, 2)), 'oiiotool': ((1, 2),) * 3, 'vips': (more,) * 3, 'three': (more, more, 'refused')}
sys.exit(list(seen.values()) != [v for e in expected.values() for v in e])
END
