#!/bin/sh
# usage: sh tests/capture.sh BUILD WORK [options of tests/blender.py]: the way of examples/CAPTURING.md, from photographs to a relightable
# model. Renders a capture by two phones into WORK (blender.py says of what), lets COLMAP find the cameras from the photographs alone, makes
# a dataset, checks it, trains, relights, and compares with what is known: cameras, lamps, box, brightness, and a model that was trained
# with the true ones. What is in WORK is not made again. Needs Blender, python3-numpy and COLMAP. Closes with "N passed, N failed".
set -eu
build=$1 work=$2 here=$(dirname "$0") passed=0 failed=0
shift 2
export QT_QPA_PLATFORM=offscreen
quiet() { "$@" >"$work/log" 2>&1 || { tail -n 20 "$work/log"; exit 1; }; }
check() { # check NAME COMMAND...
    name=$1; shift
    if "$@"; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "failed: $name"; fi
}
psnr() { sed -n 's/^ "mean": {"psnr": \([-0-9.]*\).*/\1/p' "$1/metrics.json"; }
mkdir -p "$work"
if [ ! -f "$work/rendered" ]; then
    blender -b --python-exit-code 1 -P "$here/blender.py" -- phones "$work" "$@"
    touch "$work/rendered"
fi
if [ ! -f "$work/sparse/0/images.bin" ]; then
    rm -rf "$work/database.db" "$work/sparse"
    mkdir "$work/sparse"
    model=$(python3 -c 'import json, sys; print(json.load(open(sys.argv[1]))["frames"][0]["model"])' "$work/truth.json")
    quiet colmap feature_extractor --database_path "$work/database.db" --image_path "$work/images" --ImageReader.camera_model "$model" \
        --ImageReader.single_camera_per_folder 1 --SiftExtraction.use_gpu 0 --SiftExtraction.first_octave 0
    quiet colmap exhaustive_matcher --database_path "$work/database.db" --SiftMatching.use_gpu 0
    quiet colmap mapper --database_path "$work/database.db" --image_path "$work/images" --output_path "$work/sparse"
fi
check "COLMAP joins all photographs in one model" [ "$(ls "$work/sparse")" = 0 ]

# one dataset in COLMAP's coordinates, to be trained, one in the true ones, to be compared
python3 -c 'import json, sys
for f in json.load(open(sys.argv[1]))["frames"]: print(f["file"], *(row[3] for row in f["camera_to_world"][:3]))' "$work/truth.json" >"$work/centres.txt"
mkdir -p "$work/aligned"
quiet colmap model_aligner --input_path "$work/sparse/0" --output_path "$work/aligned" --ref_images_path "$work/centres.txt" --ref_is_gps 0 \
    --alignment_type custom --robust_alignment 0
dataset() { # dataset MODEL DATASET, in WORK
    rm -rf "${work:?}/$2"
    quiet "$build/colmap" "$work/$1" --images "$work/images" --masks "$work/masks" --lamp B/ -o "$work/$2"
}
dataset sparse/0 found.set
dataset aligned aligned.set
# how far the aligned dataset is from the truth, at most, and true.set: the same photographs with the true cameras and lamps
python3 - "$work" >"$work/wrong.txt" <<'END'
import json, math, os, sys
work = sys.argv[1]
known = {f['file']: f for f in json.load(open(f'{work}/truth.json'))['frames']}
wrong = dict.fromkeys(['missing', 'camera', 'degrees', 'lamp', 'brightness', 'focal', 'box'], 0)
os.makedirs(f'{work}/true.set', exist_ok=True)
for folder in 'images', 'masks':
    if not os.path.exists(f'{work}/true.set/{folder}'):
        os.symlink(os.path.abspath(f'{work}/{folder}'), f'{work}/true.set/{folder}')
def at_most(name, value):
    wrong[name] = max(wrong[name], abs(value))
for part in 'train', 'test':
    made = json.load(open(f'{work}/aligned.set/transforms_{part}.json'))
    for f in made['frames']:
        k, m = known[f['file_path'].removeprefix('images/')], f['transform_matrix']
        t, bright = k['camera_to_world'], k['exposure']
        cosine = (sum(m[i][j] * t[i][j] for i in range(3) for j in range(3)) - 1) / 2
        wrong['missing'] -= 1
        at_most('camera', math.dist([r[3] for r in m[:3]], [r[3] for r in t[:3]]))
        at_most('degrees', math.degrees(math.acos(min(1, cosine))))
        at_most('lamp', math.dist(f['pl_pos'], k['lamp']))
        at_most('focal', f['fl_x'] / k['params'][0] - 1)
        for v in f['pl_intensity']:
            at_most('brightness', v / bright - 1)
        f.update(transform_matrix=t, pl_pos=k['lamp'], pl_intensity=[bright] * 3)
        f.update(zip(('fl_x', 'fl_y', 'cx', 'cy', 'k1', 'k2', 'p1', 'p2'), k['params']))
    for low, high in zip(made['bounds_min'], made['bounds_max']): # the body reaches from half of 0.58 to all of it
        at_most('box', max(0, low + .3, .3 - high, -.8 - low, high - .8))
    made.update(bounds_min=[-.62] * 3, bounds_max=[.62] * 3)
    json.dump(made, open(f'{work}/true.set/transforms_{part}.json', 'w'))
wrong['missing'] += len(known)
for name, value in wrong.items():
    print(name, f'{value:.5f}')
END
cat "$work/wrong.txt"
below() { awk -v name="$1" -v most="$2" '$1 == name { exit !($2 <= most) }' "$work/wrong.txt"; }
check "all photographs are in the dataset" below missing 0
check "cameras' places" below camera 0.01
check "cameras' directions" below degrees 0.2
check "focal lengths" below focal 0.005
check "lamps" below lamp 0.01
check "B's brightness beside A's" below brightness 0.02
check "the box" below box 0
check "check finds nothing" "$build/check" "$work/found.set"
for set in found.set true.set; do
    quiet "$build/train" "$work/$set" -o "$work/$set.ply" --downscale 2 --iterations 3000
    quiet "$build/relight" "$work/$set.ply" "$work/$set" --downscale 2 --out "$work/$set.lit"
done
found=$(psnr "$work/found.set.lit") true=$(psnr "$work/true.set.lit")
echo "test photographs: $found dB, with the true cameras and lamps $true dB"
check "a model of COLMAP's cameras is as good as one of the true ones, within 0.5 dB" awk -v a="$found" -v b="$true" 'BEGIN { exit !(a > b - 0.5) }'
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
