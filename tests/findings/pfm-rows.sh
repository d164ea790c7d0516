#!/bin/sh
# PFM has its rows from the bottom up, and a third line whose sign tells the byte order and whose size is a scale: so says pfm(5) of netpbm,
# which knows that others' PFM may differ. ffmpeg 5.1.9 and vips 8.14.1 (Debian's libvips-tools) take the first row for the top one, and write
# the top one first: pictures turn upside down on the way to or from oiiotool, ImageMagick and netpbm. Of a scale of 2, 0.1 is 0.2 in oiiotool
# and ImageMagick, 0.05 in ffmpeg and netpbm, and 0.1 in vips. One would guess that so small a format is read alike. What one program writes
# it reads back, so its own tests pass. Depths and measured light are kept in it.
. "$(dirname "$0")/lib.sh"
debian ffmpeg ffmpeg 5.1.9
debian vips libvips-tools 8.14.1
debian oiiotool openimageio-tools 2.4.7.1
debian convert imagemagick 6.9.11.60
debian pfmtopam netpbm 11.01.00
python3 - <<'END'
import re, struct, subprocess, sys
def run(*words): return subprocess.run(words, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout
floats = lambda data, order='<': struct.unpack(order + '%df' % (len(data) // 4), data)
def pfm(scale): open('in.pfm', 'wb').write(b'PF\n1 2\n-%d\n' % scale + struct.pack('<6f', .1, .1, .1, .3, .3, .3)) # 0.1 is the lower row
readers = { # the upper value and the lower one of in.pfm
    'ffmpeg': lambda: floats(run('ffmpeg', '-i', 'in.pfm', '-f', 'rawvideo', '-pix_fmt', 'gbrpf32le', '-'))[:2],
    'vips': lambda: [float(run('vips', 'getpoint', 'in.pfm', '0', y).split()[0]) for y in '01'],
    'oiiotool': lambda: [float(re.search(rb'Avg: (\S+)', run('oiiotool', 'in.pfm', '--cut', '1x1+0+' + y, '--printstats')).group(1)) for y in '01'],
    'ImageMagick': lambda: [v / 65535 for v in struct.unpack('<2H', run('convert', 'in.pfm', '-depth', '16', '-endian', 'LSB', 'gray:-'))],
    'netpbm': lambda: [v / 255 for v in run('pfmtopam', 'in.pfm')[-6::3]],
}
read = {name: [] for name in readers}
for scale in (1, 2):
    pfm(scale)
    for name, f in readers.items(): read[name] += [round(v, 2) for v in f()]
for name in read: print(name, 'reads upper %g, lower %g; with a scale of 2 %g, %g' % tuple(read[name]))
run('convert', '-size', '1x1', 'xc:#ff8040', 'xc:#000000', '-append', 'PNG24:in.png') # black below
writers = {'ffmpeg': ('ffmpeg', '-i', 'in.png', '-pix_fmt', 'gbrpf32le', 'ffmpeg.pfm'), 'vips': ('vips', 'copy', 'in.png', 'vips.pfm'),
    'ImageMagick': ('convert', 'in.png', 'ImageMagick.pfm')}
first = {}
for name, words in writers.items():
    run(*words)
    rows = open(name + '.pfm', 'rb').read()[-24:]
    first[name] = 'upper' if any(rows[:12]) and not any(rows[12:]) else 'lower'
    print(name, 'writes the', first[name], 'row first')
right, turned = [.3, .1], [.1, .3]
sys.exit(not (read == {'ffmpeg': turned + [.05, .15], 'vips': turned + turned, 'oiiotool': right + [.6, .2], 'ImageMagick': right + [.6, .2],
    'netpbm': right + [.15, .05]} and
    first == {'ffmpeg': 'upper', 'vips': 'upper', 'ImageMagick': 'lower'}))
END
