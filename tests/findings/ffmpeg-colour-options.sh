#!/bin/sh
# ffmpeg 5.1.9 (Debian's ffmpeg): -color_trc linear -color_primaries bt2020 in front of a PNG to be written does nothing: the file has no
# gAMA, no cHRM, no cICP, and no warning is shown. -color_trc smpte2084 is as silent. The encoder can: -vf
# setparams=color_trc=linear:color_primaries=bt2020 gives gAMA 1 and cHRM. The options are general ones of video encoders. One would guess
# that they work here, or that one is told.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 2' HUP INT TERM
command -v python3 >/dev/null || { echo "apt-get install python3 is needed"; exit 2; }
command -v ffmpeg >/dev/null || { echo "apt-get install ffmpeg is needed"; exit 2; }
found=$(ffmpeg -version | sed -n 's/^ffmpeg version \([0-9.]*\).*/\1/p')
echo "ffmpeg $found, pinned 5.1.9"
[ "$found" = 5.1.9 ] || echo "another version than the pinned one"
cd "$work"
python3 - <<'END'
import struct, subprocess, sys, zlib
def chunk(kind, data): return struct.pack('>I', len(data)) + kind + data + struct.pack('>I', zlib.crc32(kind + data))
def png(path, *extra): # 1 x 1, 16-bit RGB
    open(path, 'wb').write(b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', struct.pack('>IIBBBBB', 1, 1, 16, 2, 0, 0, 0)) + b''.join(chunk(*e) for e in extra) +
        chunk(b'IDAT', zlib.compress(b'\0' + struct.pack('>3H', 1000, 20000, 60000))) + chunk(b'IEND', b''))
def chunks(path):
    data, at, found = open(path, 'rb').read(), 8, {}
    while at < len(data):
        n, = struct.unpack('>I', data[at:at + 4])
        found[data[at + 4:at + 8].decode()] = data[at + 8:at + 8 + n]
        at += 12 + n
    return found
def colour(path): # what says how the values are to be understood
    return {kind: data.hex() if kind != 'iCCP' else 'a profile' for kind, data in chunks(path).items() if kind in ('gAMA', 'cHRM', 'sRGB', 'iCCP', 'cICP')}
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
