// Splats in PLY: one to begin with, the writer, the reader; splat-transform and spark
import { execFileSync } from 'node:child_process';
import fs from 'node:fs';
export const splat = {x: 1, y: 2, z: 3, f_dc_0: 0.5, f_dc_1: 0.25, f_dc_2: 0.125, opacity: 1, scale_0: -3, scale_1: -4, scale_2: -5, rot_0: 1, rot_1: 0, rot_2: 0, rot_3: 0};
export const floats = values => Buffer.from(new Float32Array(values).buffer);
export const vertices = splats => `element vertex ${splats.length}\n` + Object.keys(splats[0]).map(n => `property float ${n}\n`).join('');
export const rows = splats => floats(splats.flatMap(Object.values));
export const write = (file, header, ...data) => fs.writeFileSync(file, Buffer.concat([Buffer.from(`ply\nformat binary_little_endian 1.0\n${header}end_header\n`), ...data]));
export const read = file => { // the rows of a PLY of nothing but floats
    const bytes = fs.readFileSync(file), at = bytes.indexOf('end_header\n') + 11, header = bytes.toString('latin1', 0, at);
    if (!header.includes('format binary_little_endian 1.0')) throw 'it wrote another format';
    const names = [...header.matchAll(/property float (\w+)/g)].map(m => m[1]);
    return Array.from({length: +header.match(/element vertex (\d+)/)[1]}, (_, i) =>
        Object.fromEntries(names.map((n, c) => [n, bytes.readFloatLE(at + 4 * (names.length * i + c))])));
};
export const buffer = file => new Uint8Array(fs.readFileSync(file)).buffer; // as a loader takes it
export const transform = (...words) => execFileSync('node_modules/.bin/splat-transform', ['-q', '-w', ...words], {stdio: 'pipe'}); // throws where it fails
export const spark = () => { // reads in a Worker: node has none of that name, so its code runs here
    globalThis.window ??= globalThis;
    globalThis.document ??= {createElement: () => ({}), createElementNS: () => ({style: {}})};
    globalThis.Worker = class {
        constructor(url) {
            const listeners = new Set(), self = {location: {href: 'file:///'}};
            self.addEventListener = (_, f) => listeners.add(f);
            self.removeEventListener = (_, f) => listeners.delete(f);
            self.postMessage = data => setTimeout(() => this.onmessage({data}));
            self.self = self;
            this.postMessage = data => setTimeout(() => [...listeners].forEach(f => f({data})));
            new Function('self', 'postMessage', decodeURIComponent(url.replace(/^data:[^,]*,/, '')))(self, self.postMessage);
        }
        addEventListener() {}
    };
    setTimeout(() => { console.log('spark does not answer'); process.exit(2); }, 30000);
    return import('@sparkjsdev/spark');
};
