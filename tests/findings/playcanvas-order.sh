#!/bin/sh
# npm's playcanvas 2.23.3 puts splats into buckets by depth, 1024 for up to 5792 splats, and most of them near the camera: seen from outside,
# the far two thirds of a scene have seven for each 32nd of its depth. What shares a bucket is drawn in the file's order, backwards. Of three
# splats in all, two of them 10 units away from the third and 0.02 apart, the one behind can be drawn over the one in front: it depends on
# which is first. Of 1000 in a row, 560 of 999 neighbours are the wrong way round. Its pictures in WebGL show it. One would guess that so few
# splats are drawn in order, as by the published rasteriser, which compares all bits of a float.
. "$(dirname "$0")/lib.sh"
packages playcanvas@2.23.3
node --input-type=module - <<'END'
const at = 'playcanvas/build/playcanvas/src/scene/gsplat-unified/gsplat-';
Object.assign(globalThis, await import(at + 'sort-bin-weights.js')); // both are put into one Worker, where this is a global name
const { UnifiedSortWorker } = await import(at + 'unified-sort-worker.js');
let send, reply;
UnifiedSortWorker({addEventListener: (_, f) => send = f, postMessage: message => reply = message});
const sort = (heights, eye) => { // splats on the z axis, seen along it from eye: in which order they are drawn
    const z = Math.sign(eye), id = heights.join(), box = f => [0, 0, f(...heights)];
    send({command: 'addCenters', id, centers: Float32Array.from(heights.flatMap(h => [0, 0, h])).buffer});
    send({command: 'intervals', ids: [id], pixelOffsets: [[0]], intervals: [[]], totalActiveSplats: heights.length});
    send({command: 'sort', order: new ArrayBuffer(4 * heights.length), sortParams: [
        {transformedDirection: {x: 0, y: 0, z}, offset: -eye * z, scale: 1, aabbMin: box(Math.min), aabbMax: box(Math.max)}]});
    const drawn = [...new Uint32Array(reply.order)].map(i => heights[i]);
    const wrong = drawn.slice(1).filter((h, i) => Math.abs(h - eye) > Math.abs(drawn[i] - eye)).length; // farther than the one drawn before
    console.log(heights.slice(0, 3).join(' '), '... from', eye, '-> drawn', drawn.slice(0, 6).join(' '), '...', wrong, 'wrong');
    return wrong;
};
const row = Array.from({length: 1000}, (_, i) => i / 100);
const seen = [sort([0, 0.02, 10], 14), sort([0.02, 0, 10], 14), sort([0, 0.02, 10], -4), sort(row, 14), sort(row, -4), sort([0, 0.2, 10], 14)];
process.exit(seen[0] === 1 && seen[3] > 500 && [1, 2, 4, 5].every(i => seen[i] === 0) ? 0 : 1);
END
