#!/bin/sh
# usage: plain.sh BUILD [install]: plain splats with spherical harmonics look as in Spark, a renderer for three.js, in headless Chromium;
# with a wrong sign or order they would not. Spark 2.2.0 (three 0.187.0) is told to draw as the published rasteriser: 0.3 px^2 of blur
# that dims nothing, alphas from 1/255, sorted by depth along the axis, floats ("ext"). It keeps the three channels of a harmonic as
# bytes of the power of two that is not above the largest, and cuts what exceeds it, 0.49 to 0.25: so here the largest is one. To a
# target other than the canvas it draws linear light, unless three works in sRGB. Closes with "N passed, N failed".
set -u
build=$1 work=$1/plain passed=0 failed=0 spark=2.2.0 three=0.187.0
check() { # check NAME COMMAND...
    name=$1; shift
    if "$@"; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "failed: $name"; fi
}
mkdir -p "$work"
for tool in npm node chromium; do command -v $tool >/dev/null || { echo "there is no $tool"; exit 2; }; done
has() { grep -qs "\"version\": \"$2\"" "$work/node_modules/$1/package.json"; } # has PACKAGE VERSION
has @sparkjsdev/spark $spark && has three $three || npm install --silent --no-audit --no-fund --fetch-timeout=20000 --fetch-retries=0 \
    --prefix "$work" @sparkjsdev/spark@$spark three@$three >/dev/null || { echo "npm has no spark $spark or three $three"; exit 2; }
[ "${2:-}" != install ] || exit 0
cat >"$work/page.html" <<'END'
<!doctype html>
<script type="importmap">{ "imports": { "spark": "/node_modules/@sparkjsdev/spark/dist/spark.module.js",
    "three": "/node_modules/three/build/three.module.js", "three/addons/": "/node_modules/three/examples/jsm/" } }</script>
<script type="module">
const judge = async () => { // a line of each file: its name, and the dB between our pictures and Spark's of the true file of its degree
    const THREE = await import('three'), { SparkRenderer, SplatMesh } = await import('spark'), theirs = [], lines = [];
    const { files, w, h, camera_angle_x, frames } = await (await fetch('transforms_valid.json')).json();
    const renderer = new THREE.WebGLRenderer(), floats = new Float32Array(4 * w * h);
    const camera = new THREE.PerspectiveCamera(camera_angle_x * 180 / Math.PI, w / h, 0.1, 100);
    THREE.ColorManagement.workingColorSpace = THREE.SRGBColorSpace;
    renderer.setClearColor(0, 1);
    renderer.setRenderTarget(new THREE.WebGLRenderTarget(w, h, { type: THREE.FloatType }));
    for (const degree of [0, 1, 2, 3]) {
        const splats = new SplatMesh({ url: `degree_${degree}.ply`, extSplats: true }), scene = new THREE.Scene();
        const spark = new SparkRenderer({ renderer, autoUpdate: false, enableLod: false, accumExtSplats: true, sortRadial: false,
            preBlurAmount: 0.3, blurAmount: 0, minAlpha: 1 / 255, maxStdDev: 3.33 });
        scene.add(spark, splats);
        await splats.initialized;
        theirs[degree] = [];
        for (const { transform_matrix } of frames) {
            new THREE.Matrix4().set(...transform_matrix.flat()).decompose(camera.position, camera.quaternion, camera.scale);
            camera.updateMatrixWorld();
            let now, last;
            do { // until a picture of something is like the one before
                last = now;
                await spark.update({ scene, camera }); // and sorts
                renderer.render(scene, camera);
                renderer.readRenderTargetPixels(renderer.getRenderTarget(), 0, 0, w, h, floats); // rows from below
                now = Array.from(floats, (v, at) => at % 4 == 3 ? 0 : Math.round(255 * Math.min(1, Math.max(0, v))));
            } while (!last || last.every(v => !v) || last.some((v, at) => v != now[at]));
            theirs[degree].push(now);
        }
    }
    for (const [name, degree] of files) {
        const found = [name], pen = new OffscreenCanvas(w, h).getContext('2d');
        for (const [i, { file_path }] of frames.entries()) {
            pen.drawImage(await createImageBitmap(await (await fetch(`${name}/${file_path}.png`)).blob()), 0, 0);
            const other = at => theirs[degree][i][(h - 1 - Math.floor(at / 4 / w)) * 4 * w + at % (4 * w)];
            const sum = pen.getImageData(0, 0, w, h).data.reduce((s, v, at) => at % 4 == 3 ? s : s + (v - other(at)) ** 2, 0);
            found.push((10 * Math.log10(255 ** 2 * 3 * w * h / sum)).toFixed(1));
        }
        lines.push(found.join(' '));
    }
    return lines.join('\n');
};
judge().catch(error => error.stack).then(body => fetch('found', { method: 'POST', body }));
</script>
END
cat >"$work/plain.js" <<'END'
const fs = require('fs'), [, , work, action] = process.argv;
const make = () => { // a ball of splats as a file of each degree, and some with other harmonics; cameras round it
    let seed = 1;
    const random = (low, high) => low + (high - low) * (seed = Math.imul(seed, 1664525) + 1013904223 >>> 0) / 4294967296;
    const several = (n, low, high) => Array.from({ length: n }, () => random(low, high)), splats = [], files = [];
    while (splats.length < 2500) {
        const place = several(3, -0.6, 0.6), rest = several(15, 1, 4).map(power => { // the channels are mostly alike
            const largest = (random(-1, 1) < 0 ? -1 : 1) / 2 ** Math.floor(power), first = Math.floor(random(0, 3));
            return several(3, -0.2, 1).map((v, c) => c == first ? largest : v * largest);
        });
        const more = [random(-3, 5), several(3, -4.5, -2.5), several(4, -1, 1)];
        if (Math.hypot(...place) < 0.6) splats.push([place, several(3, -2.5, 2), rest, ...more]);
    }
    const list = (word, n) => Array.from({ length: n }, (_, i) => `${word}_${i}`);
    const save = (name, degree, order) => { // order(harmonics) are f_rest
        const rows = splats.map(s => s.map((v, i) => i == 2 ? order(v.slice(0, (degree + 1) ** 2 - 1)) : v).flat(2));
        const f_rest = list('f_rest', rows[0].length - 14), other = ['opacity', ...list('scale', 3), ...list('rot', 4)];
        const properties = ['x', 'y', 'z', ...list('f_dc', 3), ...f_rest, ...other].map(n => `property float ${n}\n`).join('');
        const head = `ply\nformat binary_little_endian 1.0\nelement vertex ${rows.length}\n${properties}end_header\n`;
        fs.writeFileSync(`${work}/${name}.ply`, Buffer.concat([Buffer.from(head), Buffer.from(Float32Array.from(rows.flat()).buffer)]));
        files.push([name, degree]);
    };
    const apart = rest => [0, 1, 2].map(c => rest.map(v => v[c]));
    const negated = which => rest => apart(rest.map((v, k) => which(k) ? v.map(x => -x) : v));
    for (const degree of [0, 1, 2, 3]) save('degree_' + degree, degree, apart);
    save('together', 3, rest => rest);
    save('direction', 3, negated(k => k < 3 || k > 7));
    save('backward', 3, rest => apart(rest.reverse()));
    save('channels', 3, rest => apart(rest).reverse());
    for (let i = 0; i < 15; i++) save('sign_' + i, 3, negated(k => k == i));
    const frames = [[0.5, 1], [-1.3, 1.9], [2.8, 0.6]].map(([turn, tilt], i) => {
        const [a, b, c, d] = [Math.cos(turn), Math.sin(turn), Math.cos(tilt), Math.sin(tilt)];
        const transform_matrix = [[a, -b * c, b * d, 2.5 * b * d], [b, a * c, -a * d, -2.5 * a * d], [0, d, c, 2.5 * c], [0, 0, 0, 1]];
        return { file_path: 'view_' + i, pl_pos: [0, 0, 3], transform_matrix };
    });
    fs.writeFileSync(work + '/transforms_valid.json', JSON.stringify({ camera_angle_x: 0.7, w: 256, h: 256, frames, files }));
};
const draw = () => { // serves the page to Chromium, prints what comes back
    const home = fs.mkdtempSync(work + '/home-'), flags = ['--headless', '--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader'];
    let browser;
    const server = require('http').createServer((request, reply) => {
        if (request.method == 'POST') return request.setEncoding('utf8').on('data', text => { console.log(text); browser.kill(); });
        const headers = { 'Content-Type': request.url.endsWith('.js') ? 'text/javascript' : 'text/html' };
        fs.readFile(work + request.url, (error, data) => reply.writeHead(error ? 404 : 200, headers).end(data));
    }).listen(0, '127.0.0.1', () => {
        flags.push('--enable-unsafe-swiftshader', '--user-data-dir=' + home, `http://127.0.0.1:${server.address().port}/page.html`);
        browser = require('child_process').spawn('chromium', flags, { stdio: 'ignore', timeout: 300000 }).on('exit', () => {
            fs.rmSync(home, { recursive: true, force: true, maxRetries: 9 });
            process.exit();
        });
    });
};
({ make, draw })[action]();
END
ours() { "$build/relight" "$1" "$work" --split valid --background black --out "${1%.ply}" >"$work/log" 2>&1; } # ours FILE: our pictures
least() { awk -v bound="$1" 'BEGIN { for (i = 2; i < ARGC; i++) bad += ARGV[i] < bound + 0; exit bad != 0 }' "$@"; } # least DB DB...
less() { ! least "$@"; }
rm -rf "$work"/*.ply "$work"/*/view_*.png "$work"/home-*
check "the files" node "$work/plain.js" "$work" make
for file in "$work"/*.ply; do check "our pictures: $file" ours "$file"; done
node "$work/plain.js" "$work" draw >"$work/found"
check "23 files: $(head -n 3 "$work/found")" test "$(grep -Ec '^[a-z]+(_[0-9]+)?( [0-9.]+){3}$' "$work/found")" = 23
while read -r name found; do # of three cameras
    case $name in
    degree_? | together) echo "figure plain_$name $found"; check "$name: $found dB" least 50 $found ;; # a file does not say how f_rest lies
    *) check "$name: $found dB" less 40 $found ;;
    esac
done <"$work/found"
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
