# PNG and OpenEXR: the writers, and readers of what the files say of their pixels
import struct, zlib
def picture(path, w, h, bits, kind, data, *extra): # kind: 0 grey, 2 RGB; extra: name and data of further chunks
    chunk = lambda name, data: struct.pack('>I', len(data)) + name + data + struct.pack('>I', zlib.crc32(name + data))
    row = len(data) // h
    rows = b''.join(b'\0' + data[y * row:(y + 1) * row] for y in range(h))
    open(path, 'wb').write(b'\x89PNG\r\n\x1a\n' + chunk(b'IHDR', struct.pack('>IIBBBBB', w, h, bits, kind, 0, 0, 0)) + b''.join(chunk(*e) for e in extra) +
        chunk(b'IDAT', zlib.compress(rows)) + chunk(b'IEND', b''))
def png(path, *extra): # one pixel of 16-bit RGB
    picture(path, 1, 1, 16, 2, struct.pack('>3H', 1000, 20000, 60000), *extra)
def chunks(path):
    data, at, found = open(path, 'rb').read(), 8, {}
    while at < len(data):
        n, = struct.unpack('>I', data[at:at + 4])
        found[data[at + 4:at + 8].decode()] = data[at + 8:at + 8 + n]
        at += 12 + n
    return found
def colour(path): # what says how the values are to be understood
    return {kind: data.hex() if kind != 'iCCP' else 'a profile' for kind, data in chunks(path).items() if kind in ('gAMA', 'cHRM', 'sRGB', 'iCCP', 'cICP')}
def profile(): # linear values, sRGB's primaries adapted to D50
    s15 = lambda *v: b''.join(struct.pack('>i', round(65536 * x)) for x in v)
    tags = {b'desc': b'desc' + struct.pack('>III', 0, 7, 0x6c696e65)[:12] + b'ar\0' + bytes(79), b'cprt': b'text\0\0\0\0none\0\0\0\0', b'wtpt': b'XYZ \0\0\0\0' + s15(.9642, 1, .8249),
        b'rXYZ': b'XYZ \0\0\0\0' + s15(.43607, .22249, .01392), b'gXYZ': b'XYZ \0\0\0\0' + s15(.38515, .71687, .09708), b'bXYZ': b'XYZ \0\0\0\0' + s15(.14307, .06061, .7141)}
    tags.update({c + b'TRC': b'curv' + bytes(8) for c in (b'r', b'g', b'b')})
    table, body = struct.pack('>I', len(tags)), b''
    for name, data in tags.items():
        table += name + struct.pack('>II', 128 + 4 + 12 * len(tags) + len(body), len(data))
        body += data + bytes(-len(data) % 4)
    head = struct.pack('>III', 128 + len(table) + len(body), 0, 0x02400000) + b'mntrRGB XYZ ' + struct.pack('>6H', 2024, 1, 1, 0, 0, 0) + b'acsp' + bytes(28) + s15(.9642, 1, .8249)
    return head.ljust(128, b'\0') + table + body
P3 = .68, .32, .265, .69, .15, .06, .3127, .329
RGB = [('B', 1, .25), ('G', 1, .5), ('R', 1, .75)]
def exr(path, channels, primaries=None, w=1, h=1): # channels: name, type (0 uint, 1 half, 2 float), value or what gives it of x and y
    listed = b''.join(n.encode() + b'\0' + struct.pack('<iB3xii', t, 0, 1, 1) for n, t, v in channels) + b'\0'
    rows = [b''.join(struct.pack('<' + 'Ief'[t], v(x, y) if callable(v) else v) for n, t, v in channels for x in range(w)) for y in range(h)]
    one, box = struct.pack('<f', 1), struct.pack('<4i', 0, 0, w - 1, h - 1)
    attributes = [(b'channels', b'chlist', listed), (b'compression', b'compression', b'\0'), (b'dataWindow', b'box2i', box), (b'displayWindow', b'box2i', box),
        (b'lineOrder', b'lineOrder', b'\0'), (b'pixelAspectRatio', b'float', one), (b'screenWindowCenter', b'v2f', bytes(8)), (b'screenWindowWidth', b'float', one)]
    if primaries: attributes.append((b'chromaticities', b'chromaticities', struct.pack('<8f', *primaries)))
    head = b'\x76\x2f\x31\x01\2\0\0\0' + b''.join(name + b'\0' + kind + b'\0' + struct.pack('<i', len(data)) + data for name, kind, data in attributes) + b'\0'
    at = lambda y: len(head) + 8 * h + y * (8 + len(rows[0]))
    open(path, 'wb').write(head + b''.join(struct.pack('<Q', at(y)) for y in range(h)) + b''.join(struct.pack('<ii', y, len(r)) + r for y, r in enumerate(rows)))
def headers(path): # the attributes of each part
    f = open(path, 'rb').read()
    multi, at, parts = f[5] & 0x10, 8, []
    while f[at]:
        part = {}
        while f[at]:
            name = f[at:f.index(0, at)]; at += len(name) + 1
            kind = f[at:f.index(0, at)]; at += len(kind) + 1
            n, = struct.unpack('<i', f[at:at + 4])
            part[name.decode()] = f[at + 4:at + 4 + n]
            at += 4 + n
        parts.append(part)
        at += 1
        if not multi: break
    return parts
def said(part): # its primaries
    return tuple(round(v, 4) for v in struct.unpack('<8f', part['chromaticities'])) if 'chromaticities' in part else None
