#!/bin/sh
# Chromium 156.0.8078.114 (Debian's), WebGL 2: what is too large for a half becomes NaN in the renderer that it brings along, SwiftShader: 70000 in a
# texture of halves that is filled with floats or drawn into, and by packHalf2x16(); 1000000 and infinity, too, drawn or packed. 65520 and 65536 are
# infinite. With Mesa's llvmpipe below the same browser textures hold 65504 for all that is finite, packHalf2x16() makes it infinite, and infinity
# stays; its textures round towards 0, its packHalf2x16() to the nearest half. One would guess one of these two of both, as the value is a number.
# Splats are blended in pictures of halves: there a bright light is a clipped pixel in one renderer and in the other a NaN, which no blending ends,
# and each faint layer darkens the one by up to a thousandth, but not the other.
. "$(dirname "$0")/lib.sh"
debian chromium chromium 156.0.8078.114
need xvfb-run xvfb
cat >page.html <<'END'
<!doctype html><pre></pre><script>
const values = [1 + 3 / 4096, 65504, 65520, 65536, 70000, 1000000, Infinity], n = values.length, lines = [];
const gl = document.createElement('canvas').getContext('webgl2'), data = new Float32Array(4 * n);
gl.getExtension('EXT_color_buffer_float');
values.forEach((v, i) => data[4 * i] = v);
const texture = (format, floats) => {
    const t = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, t);
    for (const filter of ['MIN', 'MAG']) gl.texParameteri(gl.TEXTURE_2D, gl[`TEXTURE_${filter}_FILTER`], gl.NEAREST);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl[format], n, 1, 0, gl.RGBA, gl.FLOAT, floats);
    return t;
};
const draw = (from, format, expression) => { // each texel's expression of v into a texture of that format
    const program = gl.createProgram(), to = texture(format, null);
    for (const [kind, body] of [['VERTEX', 'void main() { gl_Position = vec4(4 * (gl_VertexID & 1) - 1, 2 * (gl_VertexID & 2) - 1, 0, 1); }'],
        ['FRAGMENT', `precision highp float; uniform highp sampler2D t; out vec4 o; void main() { float v = texelFetch(t, ivec2(gl_FragCoord), 0).x; o = vec4(${expression}); }`]]) {
        const shader = gl.createShader(gl[kind + '_SHADER']);
        gl.shaderSource(shader, '#version 300 es\n' + body);
        gl.compileShader(shader);
        gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    gl.useProgram(program);
    gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, to, 0);
    gl.viewport(0, 0, n, 1);
    gl.bindTexture(gl.TEXTURE_2D, from);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    return to;
};
const say = (what, of) => {
    const got = new Float32Array(4 * n);
    draw(of, 'RGBA32F', 'v');
    gl.readPixels(0, 0, n, 1, gl.RGBA, gl.FLOAT, got);
    lines.push(what + ': ' + values.map((_, i) => got[4 * i]).join(' '));
};
gl.getExtension('WEBGL_debug_renderer_info');
const floats = texture('RGBA32F', data);
lines.push(/SwiftShader|llvmpipe/.exec(gl.getParameter(37446)));
say('floats', floats);
say('filled', texture('RGBA16F', data));
say('drawn', draw(floats, 'RGBA16F', 'v'));
say('packed', draw(floats, 'RGBA32F', 'unpackHalf2x16(packHalf2x16(vec2(v, 0))).x'));
document.querySelector('pre').textContent = lines.join('\n') + '\n';
</script>
END
page() { # page CHROMIUM_OPTION...: what it prints
    HOME=$work xvfb-run -a chromium --headless=new --no-sandbox --disable-dev-shm-usage "$@" --dump-dom "file://$work/page.html" 2>/dev/null |
        sed -n 's/.*<pre>//; /<\/pre>/q; /^[A-Za-z]*$/p; /^[a-z]*: /p'
}
page --use-angle=swiftshader --enable-unsafe-swiftshader >seen
page --use-gl=angle --use-angle=gl-egl --ignore-gpu-blocklist >>seen
cat seen
cat >wanted <<'END'
SwiftShader
floats: 1.000732421875 65504 65520 65536 70000 1000000 Infinity
filled: 1.0009765625 65504 Infinity Infinity NaN Infinity Infinity
drawn: 1.0009765625 65504 Infinity Infinity NaN NaN NaN
packed: 1.0009765625 65504 Infinity Infinity NaN NaN NaN
llvmpipe
floats: 1.000732421875 65504 65520 65536 70000 1000000 Infinity
filled: 1 65504 65504 65504 65504 65504 Infinity
drawn: 1 65504 65504 65504 65504 65504 Infinity
packed: 1.0009765625 65504 Infinity Infinity Infinity Infinity Infinity
END
cmp -s seen wanted
