#!/bin/sh
# CloudCompare 2.11.3 (Debian's cloudcompare), on its command line: of a splat's properties, all of them floats, a PLY that it opens and saves
# keeps x y z, nx ny nz to a thousandth, and the three scale_*, which are called scalar_scale_* then. Colours, opacity and rotation are gone, and its log, which
# says that the file was loaded and saved successfully, has no word of it. One would guess that every float is kept as a scalar field, as its
# window offers, or none: it takes the names that hold "scal" for scalar fields, and those of splats hold it by chance, as "escalator" does.
. "$(dirname "$0")/lib.sh"
debian CloudCompare cloudcompare 2.11.3
need node nodejs
cat >clouds.mjs <<'END'
import { execFileSync } from 'node:child_process';
import { read, rows, splat, vertices, write } from './files.mjs';
const {x, y, z, ...others} = splat, whole = {x, y, z, nx: 0, ny: 0, nz: 1, ...others, escalator: 7}, splats = [whole, {...whole, x: 4, scale_1: -6}];
write('in.ply', vertices(splats), rows(splats));
const log = execFileSync('CloudCompare', ['-SILENT', '-AUTO_SAVE', 'OFF', '-C_EXPORT_FMT', 'PLY', '-PLY_EXPORT_FMT', 'BINARY_LE', '-O', 'in.ply', '-SAVE_CLOUDS', 'FILE', 'out.ply'],
    {stdio: 'pipe', env: {...process.env, QT_QPA_PLATFORM: 'offscreen', HOME: process.cwd()}}).toString();
const seen = read('out.ply');
console.log(log.slice(log.indexOf('[LOADING]')), seen);
const kept = splats.map(s => ({x: s.x, y, z, nx: 0, ny: 0, nz: 1, scalar_scale_0: s.scale_0, scalar_scale_1: s.scale_1, scalar_scale_2: s.scale_2, scalar_escalator: 7}));
const silent = !/f_dc|opacity|rot_|scale_|warning|skip|ignor/i.test(log.slice(log.indexOf('[LOADING]')));
const same = (a, b) => Object.keys(a).join() === Object.keys(b).join() && Object.keys(b).every(n => Math.abs(a[n] - b[n]) < 0.002);
process.exit(seen.length === 2 && seen.every((s, i) => same(s, kept[i])) && silent ? 0 : 1);
END
node clouds.mjs
