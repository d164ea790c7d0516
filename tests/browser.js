// usage: node browser.js BUILD [CHROMIUM]: examples/view.html in headless Chromium, by its debugging pipe: what the canvas shows is
// what the server draws, and mouse, keys and buttons change it. Pictures go to BUILD/browser. Closes with "N passed, N failed".
'use strict'
const { spawn } = require('child_process'), fs = require('fs'), http = require('http'), os = require('os'), path = require('path')
const build = process.argv[2], folder = path.join(build, 'browser'), home = fs.mkdtempSync(path.join(os.tmpdir(), 'ssdgs-'))
let passed = 0, failed = 0
const check = (name, ok) => { if (ok) passed++; else failed++, console.log('failed: ' + name) }
const sleep = ms => new Promise(done => setTimeout(done, ms))
fs.mkdirSync(folder, { recursive: true })

const server = spawn(path.join(build, 'view'), ['examples/data/waxcow.ply', '--page', 'examples/view.html'])
const browser = spawn(process.argv[3] || 'chromium', ['--headless', '--no-sandbox', '--disable-gpu', '--hide-scrollbars',
    '--user-data-dir=' + home, '--remote-debugging-pipe', 'about:blank'], { stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'] })
const end = code => {
    browser.kill()
    server.kill('SIGINT')
    setTimeout(() => { fs.rmSync(home, { recursive: true, force: true }); process.exit(code) }, 500)
}
setTimeout(() => { console.log('failed: five minutes are over'); end(1) }, 300000).unref()

const waiting = new Map()
let said = '', number = 0, session
browser.stdio[4].on('data', data => {
    said += data
    for (let stop; (stop = said.indexOf('\0')) >= 0; said = said.slice(stop + 1)) {
        const message = JSON.parse(said.slice(0, stop)), done = waiting.get(message.id)
        if (!done) continue
        waiting.delete(message.id)
        message.error ? done[1](new Error(message.error.message)) : done[0](message.result)
    }
})
const send = (method, params = {}) => new Promise((...done) => {
    waiting.set(++number, done)
    browser.stdio[3].write(JSON.stringify({ id: number, method, params, sessionId: session }) + '\0')
})
const ink = 'canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height).data'
const ask = async expression => {
    const reply = await send('Runtime.evaluate', { expression, awaitPromise: true, returnByValue: true })
    if (reply.exceptionDetails) throw new Error(expression + ': ' + JSON.stringify(reply.exceptionDetails.exception || reply.exceptionDetails.text))
    return reply.result.value
}
const rest = async () => {
    for (let tries = 0; tries < 200; tries++) {
        if (await ask('document.documentElement.dataset.shown == "rest" && !asked && shown == wish(true).query')) return true
        await sleep(50)
    }
    return false
}
// the sum of the canvas's bytes, and how many of them differ from the server's picture of the same wish
const pixels = () => ask(`(async () => {
    const mine = ${ink}
    const reply = await fetch('/picture?' + wish(true).query), theirs = new Uint8Array(await reply.arrayBuffer())
    let sum = 0, other = mine.length == theirs.length ? 0 : 1e9
    for (let i = 0; i < mine.length; i++) sum += mine[i] * (i % 251), other += mine[i] != theirs[i]
    return [sum, other]
})()`)
const mouse = (type, x, y, more = {}) => send('Input.dispatchMouseEvent', { type, x, y, button: 'left', buttons: 1, clickCount: 1, ...more })
const drag = async (x, y) => {
    await mouse('mousePressed', 300, 250)
    for (let i = 1; i <= 8; i++) await mouse('mouseMoved', 300 + x * i / 8, 250 + y * i / 8)
    await mouse('mouseReleased', 300 + x, 250 + y)
}
const key = async (name, text) => {
    await send('Input.dispatchKeyEvent', { type: 'keyDown', key: name, text })
    await send('Input.dispatchKeyEvent', { type: 'keyUp', key: name })
}
const picture = async name => fs.writeFileSync(path.join(folder, name + '.png'), Buffer.from((await send('Page.captureScreenshot')).data, 'base64'))
const resize = async (width, height) => {
    await send('Emulation.setDeviceMetricsOverride', { width, height, deviceScaleFactor: 1, mobile: width < 500 })
    await sleep(200)
}

// opens a page, and waits for its first picture
const open = async (name, url) => {
    await send('Page.navigate', { url: 'about:blank' })
    const begun = Date.now()
    await send('Page.navigate', { url })
    for (let tries = 0; tries < 500 && !await ask('typeof shown == "string" && shown != ""').catch(() => false); tries++) await sleep(20)
    console.log(`figure view_${name}_first_picture_ms ${Date.now() - begun}`)
}
const moves = async name => {
    const [frames, slowest] = await ask(`new Promise(done => {
        let n = 0, seen = shown, last = performance.now(), slowest = 0
        const until = last + 3000, count = now => {
            turn(0.01, 0)
            if (shown != seen) n++, seen = shown, slowest = Math.max(slowest, now - last), last = now
            now < until ? requestAnimationFrame(count) : done([n / 3, slowest])
        }
        requestAnimationFrame(count)
    })`)
    console.log(`figure view_${name}_frames_per_second ${frames.toFixed(1)} at ${await ask('canvas.width + "x" + canvas.height')}, the slowest after ${slowest.toFixed(0)} ms`)
    check(`${name}: moves`, frames > 5)
    check(`${name}: comes to rest again`, await rest())
}
const served = async () => {
    const address = await new Promise(done => server.stdout.once('data', text => done(String(text).trim())))
    check('the address: ' + address, /^http:\/\/127\.0\.0\.1:\d+$/.test(address))
    const { targetId } = await send('Target.createTarget', { url: 'about:blank' })
    session = (await send('Target.attachToTarget', { targetId, flatten: true })).sessionId
    await resize(960, 600)
    await open('served', address)
    check('comes to rest', await rest())
    let last = await pixels()
    check('the first picture is the server\'s', last[0] > 0 && last[1] == 0)
    check('forms are dark, also those that a browser draws', await ask('getComputedStyle($("preset")).colorScheme') == 'dark')
    check('an icon is not asked for: the policy forbids it', await ask('document.querySelector("link[rel=icon]").href') == 'data:,')
    await picture('first')
    await like_relight('served')
    await ask('$("reset").click()')
    await rest()
    last = await pixels()
    const step = async (name, action, moves) => {
        const before = await ask('$("text").value')
        await action()
        check(name + ': comes to rest', await rest())
        const now = await pixels(), after = await ask('$("text").value')
        check(name + ': another picture, the server\'s', now[0] != last[0] && now[1] == 0)
        const [eye, light] = ['eye', 'light'].map(word => before.split('\n').find(l => l.startsWith(word)) != after.split('\n').find(l => l.startsWith(word)))
        check(name + ': ' + (moves || 'nothing') + ' moves', eye == (moves == 'eye') && light == (moves == 'light'))
        last = now
        await picture(name.replace(/ /g, '_'))
    }
    await ask('$("exposure").value = -4, $("exposure").dispatchEvent(new Event("input"))')
    await rest()
    check('exposure shows', (await pixels())[0] != last[0])
    await ask('$("reset").click()')
    await rest()
    check('start again takes back all', (await pixels())[0] == last[0] && await ask('$("exposure").value') == '0')
    const up = which => ask(`$('up').value = '${which}', $('up').dispatchEvent(new Event('change'))`)
    await up('y down')
    check('y is down', await rest() && /up=0,-1,0&/.test(await ask('wish(true).query')))
    const below = await pixels()
    check('y is down: another picture, the server\'s', below[0] != last[0] && below[1] == 0)
    await up('z up')
    check('z is up again', await rest() && (await pixels())[0] == last[0])
    check('a press on the facts is one on the picture', await ask(`(() => {
        const r = $('facts').getBoundingClientRect(); return document.elementFromPoint(r.x + r.width / 2, r.y + r.height / 2) == canvas })()`))
    await resize(3840, 2160)
    const wide = await ask('(() => { const w = wish(true), s = $("stage"); return [w.w, w.w / w.h / s.clientWidth * s.clientHeight] })()')
    check(`a large screen's picture is not stretched: ${wide}`, wide[0] == 2560 && Math.abs(wide[1] - 1) < 0.001)
    await resize(960, 600)
    await rest()
    await step('drag', () => drag(120, 40), 'eye')
    await step('arrow key', () => key('ArrowLeft'), 'eye')
    await step('plus key', () => key('+', '+'), 'eye')
    await step('wheel', () => send('Input.dispatchMouseEvent', { type: 'mouseWheel', x: 300, y: 250, deltaX: 0, deltaY: 120 }), 'eye')
    await step('drag the light', async () => { await key('l', 'l'); await drag(-150, 20) }, 'light')
    await key('l', 'l')
    await step('another light', () => ask('$("more").click()'))
    await step('one less', () => ask('$("less").click()'))
    for (const id of ['roughness', 'gloss', 'translucency', 'ambient', 'exposure'])
        await step(id, () => ask(`$("${id}").value = 1.2 * +$("${id}").value + 0.5; $("${id}").dispatchEvent(new Event("input"))`))
    await step('strength', () => ask('$("strength").value = 1; $("strength").dispatchEvent(new Event("input"))'), 'light')
    for (const name of ['diffuse', 'specular', 'scattering', 'shadow', 'normal', 'depth', 'alpha', 'color'])
        await step(name, () => ask(`[...$("strip").children].find(b => b.textContent == "${name}").click()`))
    await moves('served')
    for (const [width, height] of [[360, 640], [2560, 1440]]) {
        await resize(width, height)
        check(width + ' pixels: comes to rest', await rest())
        check(width + ' pixels: nothing beside the page', await ask('document.documentElement.scrollWidth <= innerWidth'))
        check(width + ' pixels: the server\'s picture', (await pixels())[1] == 0)
        await picture('wide_' + width)
    }
    check('bars of the stages', await ask('[...$("stages").children].map(row => row.firstChild.textContent).join()') === 'project,sort,bin,walk,shade,composite,picture')
    check('every control has a name', await ask('[...document.querySelectorAll("input, select, textarea, button, canvas")].every(e => e.labels && e.labels.length || e.getAttribute("aria-label") || e.textContent.trim())'))
    check('no problem', await ask('$("problem").textContent') === '')
    server.kill('SIGINT')
    check('Ctrl-C ends it cleanly', await new Promise(done => server.once('exit', code => done(code === 0))))
    await ask('touch(), turn(0.1, 0), 1')
    await sleep(500)
    check('the page says that nobody answers', /^No picture/.test(await ask('$("problem").textContent')))
}
// a model as it trains: its pictures follow, the page makes it wait and go on
const trained = async () => {
    const trainer = spawn(path.join(build, 'train'), ['examples/data/waxcow', '-o', path.join(folder, 'trained.ply'), '--iterations', '100000', '--threads', '1', '--view'])
    let told = ''
    trainer.stderr.on('data', text => told += text)
    for (let tries = 0; tries < 200 && !/to watch: http.*\n/.test(told); tries++) await sleep(50)
    const address = (told.match(/to watch: (http\S+)/) || [])[1]
    check('train --view says where', !!address)
    await resize(1100, 760)
    await send('Page.navigate', { url: address })
    const until = async what => {
        for (let tries = 0; tries < 400; tries++, await sleep(50)) if (await ask(what).catch(() => false)) return true
        return false
    }
    check('a curve and a picture', await until('curve.length > 4 && shown != "" && curve[curve.length - 1][0] > curve[0][0]'))
    check('a picture of something', await until(`${ink}.some((v, i) => i % 4 < 3 && v > 60)`))
    check('a photograph beside the model', await until('$("photograph").width == 256 && $("photograph").height == 128'))
    await ask('$("later").click()')
    check('the next photograph', await until('/^photograph 2 of [0-9]+,/.test($("which").textContent)'))
    await ask('$("pause").click()')
    check('pause', await until('$("pause").textContent == "go on"'))
    const at = await ask('fetch("/models").then(r => r.json()).then(m => m.iteration)')
    await sleep(1500)
    check('it waits', await ask('fetch("/models").then(r => r.json()).then(m => m.iteration)') == at)
    await picture('training')
    await ask('$("pause").click()')
    check('it goes on', await until(`curve[curve.length - 1][0] > ${at}`))
    trainer.kill('SIGINT')
    check('Ctrl-C stops the training', await new Promise(done => trainer.once('exit', code => done(code === 130))))
    check('the page says so', await until('/ended/.test($("progress").textContent)'))
}
// what build/relight makes of a query, as the page's browser reads it, and the most and mean difference of the page's own picture where
// the model is opaque: over the ground relight blends stored values, as photographs are, and the page light
const beside = async query => {
    const value = key => query.match(new RegExp(`${key}=([^&]*)`))[1].split(',').map(Number)
    const about = await ask('about'), [w] = value('w'), [h] = value('h'), eye = value('eye'), target = value('target'), light = value('light')
    const minus = (a, b) => a.map((x, c) => x - b[c]), dot = (a, b) => a.reduce((sum, x, c) => sum + x * b[c], 0)
    const unit = a => a.map(x => x / Math.sqrt(dot(a, a))), cross = (a, b) => [0, 1, 2].map(c => a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3])
    const back = unit(minus(eye, target)), right = unit(cross([0, 0, 1], back)), up = cross(back, right), from = minus(light.slice(0, 3), about.middle)
    const frame = { file_path: './relit', transform_matrix: [0, 1, 2].map(c => [right[c], up[c], back[c], eye[c]]).concat([[0, 0, 0, 1]]),
        pl_pos: light.slice(0, 3), pl_intensity: light.slice(3).map(x => x * dot(from, from) / about.light_scale) }
    fs.writeFileSync(path.join(folder, 'transforms_valid.json'), JSON.stringify({ camera_angle_x: value('angle')[0], w, h, frames: [frame] }))
    const relight = spawn(path.join(build, 'relight'), ['examples/data/waxcow.ply', folder, '--split', 'valid', '--out', path.join(folder, 'relit'), '--isa', 'sse2'])
    if (await new Promise(done => relight.once('exit', done)) !== 0) return [255, 255]
    const png = fs.readFileSync(path.join(folder, 'relit', 'relit.png')).toString('base64')
    return ask(`(async () => {
        const image = new Image(), other = document.createElement('canvas'), pen = other.getContext('2d')
        image.src = 'data:image/png;base64,${png}'
        await image.decode()
        other.width = ${w}, other.height = ${h}
        pen.drawImage(image, 0, 0)
        const theirs = pen.getImageData(0, 0, ${w}, ${h}).data, mine = (await source.picture('picture', '${query}')).pixels
        const alpha = (await source.picture('picture', '${query.replace('plane=color', 'plane=alpha')}')).pixels
        let most = 0, sum = 0, count = 0
        for (let i = 0; i < mine.length; i++)
            if (alpha[i - i % 4] == 255) { const d = Math.abs(mine[i] - theirs[i]); count++, sum += d, most = Math.max(most, d) }
        return count > 10000 ? [most, sum / count] : [255, 255]
    })()`)
}
const like_relight = async name => {
    for (const preset of ['default', 'preview']) {
        await ask('$("ambient").value = 0, touch()')
        const [most, mean] = await beside((await ask('wish(true).query')).replace('exact', preset)), bounds = preset === 'default' ? [1, 0.15] : [30, 0.7]
        console.log(`figure view_${name}_${preset}_from_relight ${most} ${mean.toPrecision(3)}`)
        check(`${name}, ${preset}: build/relight's picture`, most <= bounds[0] && mean <= bounds[1])
    }
}
// the page that needs no server: from a file, and from a host that isolates it, where it has threads
const alone = async () => {
    const page = path.join(build, 'view.html')
    if (!fs.existsSync(page)) return console.log('build/view.html is missing, as emscripten is: the page without a server not tested')
    const native = spawn(path.join(build, 'view'), ['examples/data/waxcow.ply', '--page', 'examples/view.html'])
    const address = await new Promise(done => native.stdout.once('data', text => done(String(text).trim())))
    const host = http.createServer((request, reply) => {
        reply.writeHead(200, { 'Content-Type': 'text/html', 'Cross-Origin-Opener-Policy': 'same-origin', 'Cross-Origin-Embedder-Policy': 'require-corp' })
        reply.end(fs.readFileSync(page))
    }).listen(0, '127.0.0.1')
    await new Promise(done => host.once('listening', done))
    console.log(`figure view_page_bytes ${fs.statSync(page).size}`)
    console.log(`figure view_code_bytes ${fs.statSync(path.join(build, 'web.wasm')).size}`)
    check('code below 400 KB', fs.statSync(path.join(build, 'web.wasm')).size < 400000)
    await resize(960, 600)
    const drawn = { file: {}, isolated: {} }
    for (const [name, url] of [['file', 'file://' + path.resolve(page)], ['isolated', `http://127.0.0.1:${host.address().port}/`]]) {
        await open(name, url)
        check(`${name}: isolated or not`, await ask('crossOriginIsolated') === (name === 'isolated'))
        for (const plane of ['diffuse', 'specular', 'scattering', 'shadow', 'normal', 'depth', 'alpha', 'color']) {
            await ask(`[...$("strip").children].find(b => b.textContent == "${plane}").click()`)
            check(`${name}, ${plane}: comes to rest`, await rest())
            const mine = drawn[name][plane] = Buffer.from(await ask(`(() => { let text = ''; for (const v of ${ink}) text += String.fromCharCode(v); return btoa(text) })()`), 'base64')
            const theirs = Buffer.from(await (await fetch(`${address}/picture?${await ask('wish(true).query')}`)).arrayBuffer())
            let most = 0, other = 0
            for (let i = 0; i < mine.length; i++) most = Math.max(most, Math.abs(mine[i] - theirs[i])), other += mine[i] !== theirs[i]
            check(`${name}, ${plane}: the server's picture but for rounding, not ${other} values by ${most}`, mine.length === theirs.length && most <= 3 && other < 1e-4 * mine.length)
        }
        await like_relight(name)
        await moves(name)
        await picture('alone_' + name)
    }
    await send('Emulation.setHardwareConcurrencyOverride', { hardwareConcurrency: 1 })
    await open('one_cpu', `http://127.0.0.1:${host.address().port}/`)
    check('isolated, with one CPU: draws', await rest())
    for (const plane in drawn.file) check(`${plane}: the same bytes with threads`, drawn.file[plane].equals(drawn.isolated[plane]))
    // files are dropped on it
    const drop = (name, bytes) => ask(`(async () => {
        const files = new DataTransfer(), bytes = Uint8Array.from(atob('${bytes.toString('base64')}'), c => c.charCodeAt(0))
        files.items.add(new File([bytes], '${name}'))
        dispatchEvent(new DragEvent('drop', { dataTransfer: files, cancelable: true }))
    })()`)
    const says = async (what, like) => {
        for (let tries = 0; tries < 60; tries++, await sleep(50)) if (like.test(await ask(what))) return true
        return false
    }
    await drop('broken.ply', Buffer.from('ply\nformat nonsense\n'))
    check('a file that is no model: the page says why', await says('$("problem").textContent', /byte|line|format/))
    check('and keeps its model', await says('$("name").textContent', /^waxcow.ply, 2500 /) && await rest())
    await drop('plain.ply', Buffer.from('ply\nformat ascii 1.0\nelement vertex 1\n' + ['x', 'y', 'z', 'scale_0', 'scale_1', 'scale_2', 'rot_0', 'rot_1', 'rot_2', 'rot_3', 'opacity', 'f_dc_0', 'f_dc_1', 'f_dc_2']
        .map(name => `property float ${name}\n`).join('') + 'end_header\n0 0 0 -1 -1 -1 1 0 0 0 4 1 1 1\n'))
    check('a model that is dropped', await says('$("name").textContent', /^plain.ply, 1 Gaussian/) && await rest())
    await picture('dropped')
    const sum = () => ask(`${ink}.reduce((sum, v) => sum + v, 0)`)
    check('a plain splat has y down, as most have', await ask('$("up").value') == 'y down')
    const plain = await sum()
    check('a plain splat: there is a switch, and no light changes it', await ask('!$("plain").hidden && getComputedStyle($("kept").parentElement).display == "none"'))
    await ask('$("lit").click()')
    check('lit: comes to rest', await rest())
    const lit = await sum()
    check('lit: another picture', lit != plain && await ask('$("lit").getAttribute("aria-pressed") == "true" && getComputedStyle($("kept").parentElement).display != "none"'))
    await ask('$("kept").value = 1, $("kept").dispatchEvent(new Event("input"))')
    check('it keeps its own light: brighter', await rest() && await sum() > lit)
    await picture('lit')
    await ask('$("lit").click()')
    check('plain again', await rest() && await sum() == plain)
    host.close()
    native.kill('SIGINT')
}
served().then(alone).then(trained).catch(error => check(error.stack, false)).then(() => {
    console.log(`${passed} passed, ${failed} failed`)
    end(failed ? 1 : 0)
})
