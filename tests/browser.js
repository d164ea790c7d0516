// usage: node browser.js BUILD [CHROMIUM]: examples/view.html in headless Chromium, by its debugging pipe: what the canvas shows is
// what the server draws, and mouse, keys and buttons change it. Pictures go to BUILD/browser. Closes with "N passed, N failed".
'use strict'
const { spawn } = require('child_process'), fs = require('fs'), os = require('os'), path = require('path')
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
setTimeout(() => { console.log('failed: three minutes are over'); end(1) }, 180000).unref()

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
    const mine = ink.getImageData(0, 0, canvas.width, canvas.height).data
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

const test = async () => {
    const address = await new Promise(done => server.stdout.once('data', text => done(String(text).trim())))
    check('the address: ' + address, /^http:\/\/127\.0\.0\.1:\d+$/.test(address))
    const { targetId } = await send('Target.createTarget', { url: 'about:blank' })
    session = (await send('Target.attachToTarget', { targetId, flatten: true })).sessionId
    await resize(960, 600)
    const begun = Date.now()
    await send('Page.navigate', { url: address })
    for (let tries = 0; tries < 100 && !await ask('typeof shown == "string" && shown != ""').catch(() => false); tries++) await sleep(20)
    console.log(`figure view_first_picture_ms ${Date.now() - begun}`)
    check('comes to rest', await rest())
    let last = await pixels()
    check('the first picture is the server\'s', last[0] > 0 && last[1] == 0)
    await picture('first')
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
    // while something moves
    const frames = ask('new Promise(done => { let n = 0, seen = shown; const until = performance.now() + 2000, count = () => { turn(0.01, 0); n += shown != seen; seen = shown; performance.now() < until ? requestAnimationFrame(count) : done(n / 2) }; count() })')
    console.log(`figure view_frames_per_second ${await frames}`)
    check('moves', await frames > 5)
    check('comes to rest again', await rest())
    for (const [width, height] of [[360, 640], [2560, 1440]]) {
        await resize(width, height)
        check(width + ' pixels: comes to rest', await rest())
        check(width + ' pixels: nothing beside the page', await ask('document.documentElement.scrollWidth <= innerWidth'))
        check(width + ' pixels: the server\'s picture', (await pixels())[1] == 0)
        await picture('wide_' + width)
    }
    check('every control has a name', await ask('[...document.querySelectorAll("input, select, textarea, button, canvas")].every(e => e.labels && e.labels.length || e.getAttribute("aria-label") || e.textContent.trim())'))
    check('no problem', await ask('$("problem").textContent') === '')
    server.kill('SIGINT')
    check('Ctrl-C ends it cleanly', await new Promise(done => server.once('exit', code => done(code === 0))))
    await ask('touch(), turn(0.1, 0), 1')
    await sleep(500)
    check('the page says that nobody answers', /^No picture/.test(await ask('$("problem").textContent')))
}
// a model as it trains: its pictures follow, the page makes it wait and go on
const watch = async () => {
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
    check('a picture of something', await until('ink.getImageData(0, 0, canvas.width, canvas.height).data.some((v, i) => i % 4 < 3 && v > 60)'))
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
test().then(watch).catch(error => check(error.stack, false)).then(() => {
    console.log(`${passed} passed, ${failed} failed`)
    end(failed ? 1 : 0)
})
