#!/bin/sh
# usage: examples.sh BUILD_DIR: what train and relight do with files of their users, and what they tell them. Closes with "N passed, N failed".
build=$1 out=$1/examples_files
passed=0 failed=0
check() { # check NAME COMMAND...
    name=$1; shift
    if "$@"; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "failed: $name"; sed 's/^/    /' "$out/log"; fi
}
says() { # says CODE TEXT COMMAND...: ends with that code and says that
    code=$1 text=$2; shift 2
    "$@" >"$out/log" 2>&1
    [ $? -eq "$code" ] && grep -q -- "$text" "$out/log"
}
lacks() { ! grep -q -- "$1" "$out/log"; }
hash_of() { find "$@" -type f -exec cksum {} + | sort; }
differs() { [ -s "$1" ] && [ -s "$2" ] && ! cmp -s "$1" "$2"; }
unchanged() { [ "$(hash_of "$set")" = "$before" ]; }
psnr() { sed -n 's/^ "mean": {"psnr": \([-0-9.]*\).*/\1/p' "$1/metrics.json"; }
near() { awk -v a="$1" -v b="$2" -v by="$3" 'BEGIN { exit !(a > b - by && a < b + by) }'; } # near A B BY

rm -rf "$out"
mkdir -p "$out/tiny/train" "$out/tiny/test"
set=$out/tiny
# 12 + 4 photographs of the demo's scene: the lines of their frames
first_frames() { # first_frames COUNT FILE
    awk -v count="$1" '/"file_path"/ && ++n > count { exit } { line[++l] = $0 } END {
        if (n <= count) { for (i = 1; i <= l; i++) print line[i]; exit }
        while (line[l] !~ /^  },/) l--
        for (i = 1; i < l; i++) print line[i]
        print "  }\n ]\n}" }' "$2"
}
first_frames 12 examples/data/waxcow/transforms_train.json >"$set/transforms_train.json"
first_frames 4 examples/data/waxcow/transforms_test.json >"$set/transforms_test.json"
for split in train test; do
    sed -n 's|.*"file_path": "\./\(.*\)",|\1.png|p' "$set/transforms_$split.json" | while read -r file; do cp "examples/data/waxcow/$file" "$set/$file"; done
done
before=$(hash_of "$set")
model=$out/model.ply
train() { "$build/train" "$set" -o "$model" --iterations 40 --points 400 --threads 1 "$@"; }
relight() { "$build/relight" "$model" "$set" --threads 1 "$@"; }

check "train" says 0 "^test: PSNR" train --checkpoint-every 30
check "train --view" says 0 "^to watch: http://127.0.0.1:" train --view -o "$out/viewed.ply"
check "changes no byte" cmp "$model" "$out/viewed.ply"
check "--seed" says 0 "^test: PSNR" train --seed 2 -o "$out/seed.ply"
check "is another model" differs "$model" "$out/seed.ply"
check "--terms" says 0 "^test: PSNR" train --terms diffuse -o "$out/terms.ply"
check "is another model, too" differs "$model" "$out/terms.ply"

# no output may be an input
ln -s tiny/test "$out/link"
mkdir -p "$out/hard"
ln "$set/train/r_000.png" "$out/hard/r_000.png"
for folder in "$set/test" "$set/./test" "$set/train/../test" "$out/link" "$set/train" "$out/hard"; do
    check "--out $folder" says 1 "would replace an input" relight --out "$folder"
done
for sheet in "$set/test/r_000.png" "$out/link/r_000.png" "$model" "$set/transforms_train.json"; do
    check "--sheet $sheet" says 1 "would replace an input" relight --out "$out/relit" --sheet "$sheet"
done
check "--sheet twice" says 1 "would be written twice" relight --out "$out/relit" --sheet "$out/relit/./r_000.png"
check "--out over a folder that is not there" says 1 "would replace an input" relight --out "$out/nowhere/../tiny/test"
check "nothing was rendered" test ! -e "$out/relit/r_000.png"
for file in transforms_train.json transforms_test.json train/r_000.png test/r_000.png; do
    check "-o $file" says 1 "would replace an input" "$build/train" "$set" -o "$set/$file" --iterations 1
done
cp "$set/transforms_train.json" "$set/x.ply.refined.json"
check "--refine over its input" says 1 "would replace an input" "$build/train" "$set" -o "$set/x.ply" --iterations 1 --refine \
    --train-json x.ply.refined.json
rm "$set/x.ply.refined.json"
check "the dataset is as it was" unchanged
check "relight" says 0 "4 images" relight --out "$out/relit" --sheet "$out/sheet.png" --components
mkdir "$out/same"
cp "$out/relit/r_000.png" "$out/same/r_000.png"
for file in r_001 r_002 r_003; do ln "$out/same/r_000.png" "$out/same/$file.png"; done
check "into files that are links to each other" says 0 "4 images" relight --out "$out/same"
check "relight again" says 0 "4 images" relight --out "$out/relit" --sheet "$out/sheet.png" --components
check "the dataset is as it was" unchanged

# where the error lies: all of it, on all pixels; its mean is the views'
shares() {
    awk -F'[|]' 'FNR == NR { if (/"file"/) { sub(/.*"psnr": /, ""); sum += 10 ^ (-$0 / 10); views++ } next }
        { for (i = 2; i < NF; i++) { split($i, share, / %| on /); error += share[1]; pixels += share[3] } }
        END { off = $1 + 10 * log(sum / views) / log(10)
            exit !(NF == 9 && error > 96 && error < 104 && pixels > 99.6 && pixels < 100.4 && off > -0.01 && off < 0.01) }' \
        "$out/relit/metrics.json" "$out/log"
}
check "show parts" says 0 "%" "$build/show" parts "$set" black "$model"
check "its shares" shares

# a level of detail is written, and is what the pictures show
check "--reduce" says 0 "4 images" relight --out "$out/reduced" --reduce 50
check "as reduced" says 0 "4 images" "$build/relight" "$out/reduced/reduced.ply" "$set" --out "$out/reduced2" --threads 1
check "the same picture" cmp "$out/reduced/r_000.png" "$out/reduced2/r_000.png"
check "another picture" differs "$out/reduced/r_000.png" "$out/relit/r_000.png"
check "--ambient" says 2 "--ambient needs a number" relight --out "$out/reduced" --ambient -1
check "--ambient --fit" says 2 "takes the room's light as it is" relight --out "$out/reduced" --ambient 0 --fit
check "--reduce 0" says 2 "--reduce needs a number" relight --out "$out/reduced" --reduce 0

# a light that goes round in one file, a sky; neither changes what lies beside
check "--animation" says 0 "480 images" relight --out "$out/path" --trajectory --size 40 --animation "$out/path/turning.png"
check "is larger than its pictures" test "$(wc -c <"$out/path/turning.png")" -gt "$(($(wc -c <"$out/path/0000.png") * 20))"
cp "$out/sheet.png" "$out/lit.png"
check "--sky" says 0 "4 images" relight --out "$out/lit" --sky "$out/lit.png"
check "another picture, too" differs "$out/lit/r_000.png" "$out/relit/r_000.png"
check "without scores" test ! -e "$out/lit/metrics.json"
check "over the map" says 1 "would replace an input" relight --out "$out/lit" --sky "$out/lit.png" --sheet "$out/lit.png"

# several photographs a step: how far it is, and checkpoints
check "--set batch=3" says 0 "iterations left" "$build/train" "$set" -o "$out/batch.ply" --iterations 180 --points 200 --threads 1 --set batch=3 --checkpoint-every 100
check "a checkpoint after the hundredth" grep -q SSDGSCK "$out/batch.ply.ckpt"
check "which goes on" says 0 "^test: PSNR" "$build/train" "$set" -o "$out/batch.ply" --iterations 180 --points 200 --threads 1 --set batch=3 --resume

check "a last batch that goes past the end" says 0 "60/60" "$build/train" "$set" -o "$out/past.ply" --iterations 60 --points 200 --threads 1 --set batch=8
check "is not told of" lacks "64/60"

# fewer Gaussians, trained on
check "--refit" says 0 "refit.ply: 50 Gaussians" "$build/train" "$set" -o "$out/refit.ply" --refit "$model" --max-gaussians 50 --iterations 60 --threads 1
check "--refit of itself" says 1 "would replace an input" "$build/train" "$set" -o "$out/refit.ply" --refit "$out/refit.ply"
check "--refit keeps the settings" says 2 "keeps what the model computes" "$build/train" "$set" -o "$out/refit2.ply" --refit "$model" --set eta=2
check "--refit of nothing" says 1 "nowhere.ply" "$build/train" "$set" -o "$out/refit.ply" --refit "$out/nowhere.ply"
refitted=$("$build/relight" "$out/refit.ply" "$set" --out "$out/refit" --threads 1 | sed -n 's/^test: PSNR \([0-9.]*\).*/\1/p')
check "--refit learns: $refitted dB, $(psnr "$out/reduced") before" awk -v a="$refitted" -v b="$(psnr "$out/reduced")" 'BEGIN { exit !(a > b + 0.1) }'

# names that differ in case, or by what components add, are numbered
sed -e 's|test/r_001|test/R_000|' -e 's|test/r_002|test/r_000_depth|' "$set/transforms_test.json" >"$out/names.json"
cp "$set/test/r_001.png" "$set/test/R_000.png" 2>/dev/null
cp "$set/test/r_002.png" "$set/test/r_000_depth.png"
cp "$set/transforms_test.json" "$out/kept.json"
cp "$out/names.json" "$set/transforms_test.json"
check "names alike" says 0 "4 images" relight --out "$out/names" --components
check "names alike are numbered" test -e "$out/names/0003_depth.png" -a ! -e "$out/names/r_000.png"
sed -e 's|test/r_001|test/r_000_depth|' -e 's|test/r_002|test/r_000_depth_depth|' "$set/transforms_test.json" >"$out/names.json"
cp "$set/test/r_002.png" "$set/test/r_000_depth_depth.png"
cp "$set/transforms_test.json" "$out/names.kept" && cp "$out/names.json" "$set/transforms_test.json"
check "a suffix twice" says 0 "4 images" relight --out "$out/names2" --components
check "is numbered" test -e "$out/names2/0003_depth.png"
cp "$out/names.kept" "$set/transforms_test.json"
rm -f "$set/test/r_000_depth_depth.png"
check "--trajectory --fit" says 2 "--trajectory has no photographs" relight --out "$out/names2" --trajectory --fit
check "--trajectory --split" says 2 "--trajectory has no photographs" relight --out "$out/names2" --trajectory --split test
check "--animation alone" says 2 "--trajectory is needed for --animation" relight --out "$out/names2" --animation "$out/a.png"
check "--size alone" says 2 "--trajectory is needed for --size" relight --out "$out/names2" --size 32
check "--size 0" says 2 "--size needs a number from 1 to 4096" relight --out "$out/names2" --trajectory --size 0
check "--sky --fit" says 2 "so it takes no --fit" relight --out "$out/names2" --sky "$out/sheet.png" --fit
check "--sky --ambient" says 2 "so it takes no --ambient" relight --out "$out/names2" --sky "$out/sheet.png" --ambient 1
check "--sky of no picture" says 1 "model.ply: byte 0" relight --out "$out/names2" --sky "$model"
check "--sky of nothing" says 1 "none.png: cannot be opened" relight --out "$out/names2" --sky "$out/none.png"
check "an animation that cannot be written" says 1 "cannot be written" relight --out "$out/unmoved" --trajectory --animation "$out/no/such/a.png"
check "an animation over an input" says 1 "would replace an input" relight --out "$out/unmoved" --trajectory --animation "$set/train/r_000.png"
check "is told before a picture is made" test ! -e "$out/unmoved/0000.png"
check "a sheet that cannot be written" says 1 "cannot be written" relight --out "$out/unsheeted" --sheet "$out/no/such/sheet.png"
check "is told before a picture is made" test ! -e "$out/unsheeted/r_000.png"
cp "$out/kept.json" "$set/transforms_test.json"
rm -f "$set/test/R_000.png" "$set/test/r_000_depth.png"
check "the dataset is as it was" unchanged

# a checkpoint of a run that was stopped further on stays, one of a run that ended is replaced with its model
further() { "$build/train" "$set" -o "$out/further.ply" --points 100 "$@"; }
"$build/train" "$set" -o "$out/further.ply" --points 100 --iterations 100000 --checkpoint-every 30 >/dev/null 2>&1 &
runner=$!
for second in $(seq 60); do [ ! -s "$out/further.ply.ckpt" ] || break; sleep 1; done
kill -INT $runner
wait $runner
kept=$(hash_of "$out/further.ply.ckpt")
check "a shorter run" says 1 "holds a run of [0-9]* iterations, and this one of 20 would replace it" further --iterations 20
check "its checkpoint stays" test "$(hash_of "$out/further.ply.ckpt")" = "$kept"
again() { train -o "$out/again.ply" "$@"; }
check "a run" says 0 "^test: PSNR" again --iterations 25
check "a shorter one in its place" says 0 "^test: PSNR" again --iterations 20
check "goes on longer, and tells" says 0 "note: .*again.ply.ckpt: iterations was 20 in its run and is 30 now" again --iterations 30 --resume
best() { train -o "$out/best.ply" --keep-best "$@"; }
echo "an older run's" >"$out/best.ply.best"
check "holds photographs out" says 0 "held out: PSNR [0-9.]* after 2 iterations, the best so far" best
check "the last score is told" grep -q "held out: PSNR [0-9.]* after 40 iterations" "$out/log"
check "and which is kept" grep -q "best.ply: .* scores best on the photographs held out, [0-9.]*$" "$out/log"
check "no other file stays" test ! -e "$out/best.ply.best"
cp "$out/best.ply" "$out/best.ply.best"
check "it goes on with those" says 0 "held out: PSNR [0-9.]* so far at best" best --iterations 44 --resume
check "to the end" grep -q "held out: PSNR [0-9.]* after 44 iterations" "$out/log"
check "no more" says 0 "note: 44 iterations are done already" best --iterations 10 --resume
check "others are not those of its run" says 1 "its run had 11 photographs, this one has 12" train -o "$out/best.ply" --iterations 44 --resume
check "smaller photographs" says 0 "tiny: 12 photographs of 42x42" again --downscale 3
check "and of those its pictures" says 0 "^test: PSNR" "$build/relight" "$out/again.ply" "$set" --out "$out/small" --downscale 3
check "of that size" test "$(od -An -tu1 -j19 -N1 "$(ls "$out"/small/*.png | head -n 1)")" -eq 42
check "none are left" says 1 "too few to be made 129 times smaller" again --downscale 129
ln -s "$out/target.ply" "$out/dangling.ply"
check "a link to nothing" says 0 "^test: PSNR" "$build/train" "$set" -o "$out/dangling.ply" --iterations 1 --points 100
check "its target is not made" test ! -e "$out/target.ply"
check "--resume with another seed" says 1 "model.ply.ckpt: seed was 1 in its run and is 2 now: " train --checkpoint-every 30 --seed 2 --resume
check "with a setting changed" says 1 "light_map.bias was 0.06 in its run and is 0.05 now: " train --checkpoint-every 30 --set light_bias=0.05 --resume
file=$(sed -n 's|.*"file_path": "\./\(.*\)",|\1.png|p' "$set/transforms_train.json" | sed -n 3p)
cp "$set/$file" "$out/kept.png"
cp "$set/$(sed -n 's|.*"file_path": "\./\(.*\)",|\1.png|p' "$set/transforms_train.json" | sed -n 4p)" "$set/$file"
check "with a photograph changed" says 1 "photograph 2 has other pixels than in its run: .*(photograph 2 is $set/\(\./\)\?$file)" train --checkpoint-every 30 --resume
cp "$out/kept.png" "$set/$file"
check "--resume" says 0 "^test: PSNR" train --checkpoint-every 30 --resume
check "many iterations" says 1 "note: 3601 iterations are many for 12 photographs: .* Try --keep-best, --iterations 1200" train -o "$out/none.ply" --iterations 3601 --resume
check "not too many" says 1 "none.ply.ckpt: cannot be opened" train -o "$out/none.ply" --iterations 3600 --resume
check "which are not told" lacks "iterations are many"
echo "somebody's notes" >"$out/notes.ply.ckpt"
check "no checkpoint" says 1 "it is not a checkpoint, and would be replaced" "$build/train" "$set" -o "$out/notes.ply" --iterations 1
check "it stays" grep -q somebody "$out/notes.ply.ckpt"

# COLMAP's models
mkdir -p "$out/sparse/0" "$out/sparse/1" "$out/photos/A"
cp tests/golden/colmap/*.txt "$out/sparse/0"
sed '/A_000/,$d' tests/golden/colmap/images.txt >"$out/sparse/1/images.txt"
cp tests/golden/colmap/cameras.txt "$out/sparse/1"
of_colmap() { "$build/colmap" "$@" --images "$out/photos" -o "$out/of_colmap"; }
check "no photographs" says 1 "none of the 56 photographs is there, as A/A_000.png" of_colmap "$out/sparse/0"
cp "$set/train/$(ls "$set/train" | head -n 1)" "$out/photos/A/A_000.png"
check "of another size" says 1 "the image has 128 x 128 pixels, not w x h: .*A_000.png" of_colmap "$out/sparse/0"
check "a model beside it" grep -q "note: beside this model lie others that could not be joined with it (1): not used" "$out/log"
check "photographs that are not there" grep -q "note: 55 of the 56 photographs in the model are not in $out/photos: left out" "$out/log"
check "the largest of several" says 1 "note: 2 models could not be joined (photographs of each: 0: 56, 1: [0-9]*): model 0 is used" of_colmap "$out/sparse"
check "colmap --help" says 0 "where the LED is beside the lamp's lens" "$build/colmap" --help

# an edited model, and its networks back
check "whole" says 0 "4 images" relight --out "$out/whole"
LC_ALL=C sed '/^element ssdgs_settings 1$/,/^end_header$/{/^end_header$/!d;}' "$model" >"$out/edited.ply"
check "edited" says 0 "note: .*edited.ply: has no settings" "$build/relight" "$out/edited.ply" "$set" --out "$out/edited" --threads 1
check "edited looks different" test "$(psnr "$out/edited")" != "$(psnr "$out/whole")"
check "--networks" says 0 "are those of" "$build/relight" "$out/edited.ply" "$set" --out "$out/given" --threads 1 --networks "$model"
check "in one file" says 0 "4 images" "$build/relight" "$out/given/whole.ply" "$set" --out "$out/one" --threads 1
check "the same picture of it" cmp "$out/given/r_000.png" "$out/one/r_000.png"
check "and is whole again" test "$(psnr "$out/given")" = "$(psnr "$out/whole")"

# models with nothing to see
header() { printf 'ply\nformat ascii 1.0\nelement vertex %s\n' "$1"; printf 'property float %s\n' x y z opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3 \
    f_dc_0 f_dc_1 f_dc_2; echo end_header; }
header 0 >"$out/none.ply"
check "no Gaussians" says 0 "none.ply: holds no Gaussians" "$build/relight" "$out/none.ply" "$set" --out "$out/none"
check "black" says 0 "is black: the model holds no Gaussians" "$build/relight" "$out/none.ply" "$set" --out "$out/none"
{ header 2; echo "nan 0 0 3 -2 -2 -2 1 0 0 0 1 1 1"; echo "0 0 0 3 -2 -2 -2 1 0 0 0 1 1 1"; } >"$out/half.ply"
check "half" says 0 "half.ply: 1 Gaussians of 2 are left out" "$build/relight" "$out/half.ply" "$set" --out "$out/half"
check "baked" says 0 "half.ply: plain splats" "$build/relight" "$out/half.ply" "$set" --out "$out/half"
{ header 1; echo "500 0 0 3 -2 -2 -2 1 0 0 0 1 1 1"; } >"$out/far.ply"
check "elsewhere" says 0 "is black: no Gaussian is in the picture" "$build/relight" "$out/far.ply" "$set" --out "$out/far"
sed 's/^    100.0/    0.0/' "$set/transforms_test.json" >"$out/dark.json"
mkdir "$out/dark_set"
cp -r "$set/test" "$out/dark_set/test"
cp "$out/dark.json" "$out/dark_set/transforms_test.json"
check "dark" says 0 "is black: the light's intensity is 0" "$build/relight" "$model" "$out/dark_set" --out "$out/dark"
check "all of them" says 0 "4 pictures of 4 are black" "$build/relight" "$model" "$out/dark_set" --out "$out/dark"

# the scene somewhere else, where floats are half a unit apart: trains as at 0, and comes back there
shift_set() { # shift_set FROM TO: every position by (5e6, -4e6, 6e6)
    awk 'BEGIN { by[1] = 5e6; by[2] = -4e6; by[3] = 6e6 }
        /"pl_pos"/ { pos = 1; n = 0 } /"transform_matrix"/ { matrix = 1; n = 0 } /"pl_intensity"/ { pos = matrix = 0 }
        /^ *-?[0-9.e+-]+,?$/ { n++; v = $1; comma = sub(/,/, "", v)
            if (pos && n <= 3) $0 = sprintf("%.9f%s", v + by[n], comma ? "," : "")
            if (matrix && n % 4 == 0 && n <= 12) $0 = sprintf("%.9f%s", v + by[n / 4], comma ? "," : "") }
        /^   \]/ { pos = matrix = 0 } { print }' "$1" >"$2"
}
mkdir "$out/moved"
cp -r "$set/train" "$set/test" "$out/moved"
for split in train test; do shift_set "$set/transforms_$split.json" "$out/moved/transforms_$split.json"; done
check "far away" says 0 "coordinates are taken relative to 5e+06, -4e+06, 6e+06\|coordinates are taken relative to 5000000" \
    "$build/train" "$out/moved" -o "$out/moved.ply" --iterations 40 --points 400 --threads 1 --refine \
    --set bounds_min=4999999.5,-4000000.5,5999999.5 --set bounds_max=5000000.5,-3999999.5,6000000.5
check "near" says 0 "^test: PSNR" train --refine -o "$out/near.ply"
check "and the room's light" says 0 "^light from the room: [0-9.]*,[0-9.]*,[0-9.]* of the lamps'" train --refine -o "$out/room.ply"
check "which may be known" says 0 "^test: PSNR" train --set ambient=20,10,5 -o "$out/room.ply"
check "relit in much of it" says 0 "4 images" "$build/relight" "$out/room.ply" "$set" --out "$out/room" --threads 1 --ambient 2.5
check "relit without it" says 0 "4 images" "$build/relight" "$out/room.ply" "$set" --out "$out/no_room" --threads 1 --ambient 0
check "that differs" differs "$out/room/r_000.png" "$out/no_room/r_000.png"
check "relit far away" says 0 "4 images" "$build/relight" "$out/moved.ply" "$out/moved" --out "$out/moved_relit" --threads 1
check "relit near" says 0 "4 images" "$build/relight" "$out/near.ply" "$set" --out "$out/near_relit" --threads 1
check "as good as at 0: $(psnr "$out/moved_relit") and $(psnr "$out/near_relit") dB" near "$(psnr "$out/moved_relit")" "$(psnr "$out/near_relit")" 0.3
check "its refined lights are there" awk '/"pl_pos"/ { n++; gsub(/[^-0-9.e+ ]/, " "); if ($1 < 4999990 || $1 > 5000010 || $3 < 5999990) bad = 1 }
    END { exit bad || !n }' "$out/moved.ply.refined.json"
check "its Gaussians are floats" grep -aq "property float x" "$out/moved.ply"

# the level: models that are given or made, frames that differ, nothing written where something is wrong
engine() { "$build/engine" --frames 2 --size 96 54 --out "$out/level_" "$@"; }
check "engine" "$build/engine" --frames 2 --size 96 54 --out "$out/made_"
check "engine with a model" "$build/engine" --frames 1 --size 96 54 --out "$out/given_" "$model"
check "engine on a GPU, where there is one" "$build/engine" --frames 1 --size 96 54 --out "$out/gpu_" --gpu "$model"
check "its pictures" test -s "$out/made_001.png" -a -s "$out/made_sheet.png" -a ! -e "$out/made_002.png"
check "they differ" differs "$out/made_000.png" "$out/made_001.png"
check "models too" differs "$out/made_000.png" "$out/given_000.png"
check "a model that is not there" says 1 "nothing.ply" engine "$out/nothing.ply"
check "no frames" says 2 "^usage: engine" engine --frames 0
check "no such option" says 2 "^usage: engine" engine --wrong
check "a folder that is not there" says 1 "never" "$build/engine" --frames 1 --size 96 54 --out "$out/never/x"
check "nothing was written" test ! -e "$out/level_000.png"

# what fitting gains is told apart
check "relight --fit" says 0 "^test (each camera and light fitted to its photograph): PSNR" relight --out "$out/fitted" --fit
fitted() { sed -n 's/.*"fitted": {"mean": {"psnr": \([-0-9.]*\).*/\1/p' "$out/fitted/metrics.json"; }
check "fitted gains: $(fitted) over $(psnr "$out/fitted")" awk -v a="$(fitted)" -v b="$(psnr "$out/fitted")" 'BEGIN { exit !(a > b && a < b + 6) }'
check "each view" test "$(grep -c '"file"' "$out/fitted/metrics.json")" -eq 8
check "without it there is none" says 0 "4 images" relight --out "$out/fixed"
check "only fixed ones" test -z "$(grep fitted "$out/fixed/metrics.json")"
# two lights of 30 and 70 in one place are one of 100
mkdir -p "$out/lamps"
cp -r "$set/test" "$out/lamps"
tr -d '\n' <"$set/transforms_test.json" | sed 's/"pl_intensity": *\[ *100.0, *100.0, *100.0 *\], *"pl_pos": *\(\[[^]]*\]\)/"pl_lights": [{"pl_intensity": 30, "pl_pos": \1}, {"pl_intensity": 70, "pl_pos": \1}]/g' >"$out/lamps/transforms_test.json"
check "two lamps" says 0 "4 images" "$build/relight" "$model" "$out/lamps" --out "$out/lit" --threads 1
check "look like one" near "$(psnr "$out/lit")" "$(psnr "$out/fixed")" 0.02

# splats for viewers: as near to the model without its highlights as colours of a byte allow, and nothing of the user's replaced
export_of() { "$build/export" "$@"; }
near_to() { sed -n "s|.*$1: .* model, \\([0-9.]*\\) dB without.*|\\1|p" "$out/log"; }
check "a model that looks like something" says 0 "^test: PSNR" train --iterations 120 -o "$out/longer.ply"
check "export" says 0 "exported.splat: " export_of "$out/longer.ply" "$out/exported"
for file in glb ply splat; do
    check "exported.$file: $(near_to "exported.$file") dB" awk -v a="$(near_to "exported.$file")" 'BEGIN { exit !(a > 27) }'
    check "is there" test -s "$out/exported.$file"
done
check "the picture" test -s "$out/exported.png"
places=$(sed -n 's/^x y z in .ply and .splat are \([-0-9.e+]*\) + x, \([-0-9.e+]*\) + z, \([-0-9.e+]*\) - y$/\1 \2 \3/p' "$out/log")
exported="$(near_to exported.glb) $(near_to exported.ply) $(near_to exported.splat)"
check "--keep" says 0 "^x y z in all files are 0 + x, 0 + y, 0 + z in the dataset$" export_of "$out/longer.ply" "$out/kept" --keep
for file in glb ply splat; do
    check "kept.$file is as near as exported.$file" near "$(near_to "kept.$file")" "${exported%% *}" 0.1
    exported=${exported#* }
done
gaussians=$(($(wc -c <"$out/exported.splat") / 32))
for name in exported kept; do
    tail -c $((gaussians * 68)) "$out/$name.ply" | od -An -v -tf4 -w68 >"$out/$name.floats"
    od -An -v -tu1 -w32 "$out/$name.splat" | cut -c 113- >"$out/$name.bytes"
done
undone() { # how the files' places become the dataset's: as it was printed; y is down
    paste -d ' ' "$out/exported.floats" "$out/kept.floats" | awk -v places="$places" 'function off(a, b) { return a > b + 1e-5 || a < b - 1e-5 }
        { split(places, p, " "); bad += off(p[1] + $1, $18) || off(p[2] + $3, $19) || off(p[3] - $2, $20); low = $2 < low ? $2 : low; high = $20 > high ? $20 : high }
        END { exit bad || NR < 100 || off(p[3] - low, high) || !(low < -0.1) }'
}
check "the places are undone by what is printed: $places" undone
turned() { # turned FILE: quaternions as bytes: the largest number is negative; near what they mean to readers of both kinds
    paste -d ' ' "$out/$1.floats" "$out/$1.bytes" | awk 'function angle(half, unit,   c, dot, a, b) {
            for (c = 0; c < 4; c++) { v = ($(18 + c) - half) / unit; dot += v * $(14 + c); a += v * v; b += $(14 + c) ^ 2 }
            dot = dot / sqrt(a * b); dot = dot < 0 ? -dot : dot; return dot < 1 ? 2 * atan2(sqrt(1 - dot * dot), dot) * 57.29578 : 0 }
        { low = high = $18; for (c = 19; c < 22; c++) { low = $c < low ? $c : low; high = $c > high ? $c : high }
          bad += low + high > 256 || angle(127.5, 127.5) > 1.3 || angle(128, 128) > 1.3; sum += angle(127.5, 127.5); other += angle(128, 128) }
        END { exit bad || NR < 100 || !(sum / NR < 0.65 && other / NR < 0.65) }'
}
check "bytes of quaternions" turned exported
check "and of those kept" turned kept
check "in another light" says 0 "moved.splat: " export_of "$out/longer.ply" "$out/moved" --light 1 -2 2
check "which shows" differs "$out/moved.png" "$out/exported.png"
check "splats of it" says 0 "plain splats" "$build/relight" "$out/kept.ply" "$set" --out "$out/splats"
kept=$(psnr "$out/splats")
check "splats turned" says 0 "plain splats" "$build/relight" "$out/exported.ply" "$set" --out "$out/splats"
check "look otherwise: $(psnr "$out/splats"), not $kept dB" awk -v a="$kept" -v b="$(psnr "$out/splats")" 'BEGIN { exit !(a > b + 1) }'
check "--linear" says 2 "^usage: export" export_of "$model" "$out/linear" --linear
cp "$model" "$out/own.ply"
check "over the model" says 1 "would replace an input" export_of "$out/own.ply" "$out/own"
check "a model that is not there" says 1 "nothing.ply" export_of "$out/nothing.ply" "$out/none"
check "a plain splat" says 1 "is a plain splat: build/unbake" export_of "$out/exported.ply" "$out/none"
check "a folder that is not there" says 1 "never" export_of "$model" "$out/never/x"
check "no names" says 2 "^usage: export" export_of
check "nothing was written" test ! -e "$out/none.glb"

# a capture, looked at before it is trained on
mkdir "$out/checked"
check "check" says 0 "^[0-9]* things\\? to look at$" "$build/check" "$set" --out "$out/checked"
check "how many photographs" grep -q "^-> [0-9]* photographs of 128 x 128: a hundred and more" "$out/log"
check "its outlines" grep -q "^   all show the object's outline$" "$out/log"
check "how long it takes" grep -q "20000 iterations take [0-9]* minutes and more here" "$out/log"
check "its pictures" test -s "$out/checked/photographs.png" -a -s "$out/checked/places.svg"
check "a place for each camera" test "$(grep -c '<circle' "$out/checked/places.svg")" -gt 20
check "a box beside it" says 0 "lie outside of bounds_min" "$build/check" "$set" --bounds 3,3,3,4,4,4
check "a set that is not there" says 1 "nothing" "$build/check" "$out/nothing"
check "into a folder that is not there" says 0 "to look at$" "$build/check" "$set" --out "$out/new/checked/"
check "which is made" test -s "$out/new/checked/photographs.png" -a -s "$out/new/checked/places.svg"
check "into what is no folder" says 1 "model.ply/x: the folder cannot be made: " "$build/check" "$set" --out "$model/x"
first_frames 7 "$set/transforms_train.json" >"$set/seven.json"
check "--train-json" says 0 "^-> 7 photographs of 128 x 128: " "$build/check" "$set" --train-json seven.json
rm "$set/seven.json"
check "--train-json of nothing" says 1 "seven.json" "$build/check" "$set" --train-json seven.json
# a list in millimetres beside a model and a box in metres
mkdir "$out/millimetres"
cp -r "$set/train" "$set/test" "$out/millimetres"
for split in train test; do
    awk '/"pl_pos"/ { pos = 1; n = 0 } /"transform_matrix"/ { matrix = 1; n = 0 } /"pl_intensity"/ { pos = matrix = 0 }
        /^ *-?[0-9.e+-]+,?$/ { n++; v = $1; comma = sub(/,/, "", v)
            if ((pos && n <= 3) || (matrix && n % 4 == 0 && n <= 12)) $0 = sprintf("%.9f%s", 1000 * v, comma ? "," : "") }
        /^   \]/ { pos = matrix = 0 } { print }' "$set/transforms_$split.json" >"$out/millimetres/transforms_$split.json"
done
unit="and the nearest camera stands .* away: does the list have millimetres where it has metres"
check "check: another unit" says 0 "^-> the box that holds the object is 1 wide, $unit" "$build/check" "$out/millimetres"
check "relight: another unit" says 0 "note: the model is [01].* wide, $unit" "$build/relight" "$model" "$out/millimetres" --out "$out/other_unit" --threads 1
check "train: another unit" says 0 "note: bounds_min .. bounds_max is 1 wide, $unit" "$build/train" "$out/millimetres" -o "$out/other_unit.ply" --iterations 1 --points 50 --threads 1
check "the right unit" says 0 "4 images" relight --out "$out/same_unit"
check "no note" lacks "does the list have"
check "no box" says 2 "^usage: check" "$build/check" "$set" --bounds 1,2,3
check "no set" says 2 "^usage: check" "$build/check"

# the viewer finds its page from anywhere, or says where it looked
absolute=$(cd "$build" && pwd)
view_from() { # view_from FOLDER PROGRAM: what it says within two seconds
    (cd "$1" && { "$2" "$absolute/examples_files/model.ply" 2>&1 & pid=$!; sleep 2; kill $pid; wait $pid; } 2>/dev/null)
    true
}
check "view" says 0 "^http://127.0.0.1:" view_from . "$build/view"
if [ -e "$build/../examples/view.html" ]; then check "from elsewhere" says 0 "^http://127.0.0.1:" view_from / "$absolute/view"; fi
mkdir "$out/moved_view"
cp "$build/view" "$out/moved_view"
check "without its page" says 0 'no view.html in "examples/", ".*/moved_view/" or ".*/moved_view/../examples/"; view has --page FILE' \
    view_from / "$absolute/examples_files/moved_view/view"
cp examples/view.html "$out/moved_view"
check "with its page" says 0 "^http://127.0.0.1:" view_from / "$absolute/examples_files/moved_view/view"

# options of ball may stand anywhere
check "--focal 1e999" says 2 "^usage: ball" "$build/ball" 20 20 10 "$set/test/r_000.png" --focal 1e999
check "bounds the wrong way round" says 2 "first corner" "$build/check" "$set" --bounds 1,1,1,0,0,0
check "train -o nothing" says 1 "output's name is empty" "$build/train" "$set" -o ""
check "train -o /dev/null" says 1 "a folder or a device" "$build/train" "$set" -o /dev/null
check "train --set bounds_min=nan" says 2 "cannot set .*bounds_min=nan" "$build/train" "$set" -o "$out/lit2.ply" --set bounds_min=nan,0,0
check "train --iterations, too many" says 2 "from 1 to 2000000000, not" "$build/train" "$set" -o "$out/lit2.ply" --iterations 99999999999
# a checkpoint that finds no room: the model is there, and tested
"$build/train" "$set" -o "$out/small.ply" --iterations 10 --points 300 >/dev/null 2>&1
(ulimit -f $(($(wc -c <"$out/small.ply") / 512 + 8)); says 1 "small.ply.ckpt: cannot be" "$build/train" "$set" -o "$out/small.ply" --iterations 10 --points 300 --seed 2) && code=0 || code=1
check "a full disk" test $code = 0
check "and what was trained" grep -q "^test: PSNR" "$out/log"
check "check --out nothing" says 2 "^usage: check" "$build/check" "$set" --out ""
check "export to nothing" says 2 "^usage: export" export_of "$model" ""
check "export to a folder" says 2 "^usage: export" export_of "$model" "$out/"
check "engine --frames 2abc" says 2 "^usage: engine" engine --frames 2abc
check "--light a b c" says 2 "^usage: export" export_of "$model" "$out/unlit" --light a b c
check "ball" says 1 "r_000.png: " "$build/ball" --focal 500 20 20 10 "$set/test/r_000.png"

# a plain splat of the model, lit again
"$build/export" "$model" "$out/baked" --keep >/dev/null 2>&1
check "unbake" says 0 "lit.ply: [0-9]* Gaussians that take light" "$build/unbake" "$out/baked.ply" -o "$out/lit.ply" --ambient 1,1,1 --medium 20,1 --roughness 0.4 --f0 0.05
check "lit" says 0 "4 images" "$build/relight" "$out/lit.ply" "$set" --out "$out/lit" --threads 1
check "unbake --keep" says 0 "kept.ply: " "$build/unbake" "$out/baked.ply" -o "$out/kept.ply" --keep 0.5
check "a plain splat in an engine" says 0 "model 1: $(sed -n 's/^element vertex //p' "$out/baked.ply") Gaussians" engine --frames 1 --size 16 16 "$model" "$out/baked.ply"
printf 'NGSP\004\000\000\000' >"$out/new.spz"
check "unbake a newer SPZ" says 1 "new.spz: SPZ of version 4 or later" "$build/unbake" "$out/new.spz" -o "$out/lit2.ply"
check "view a newer SPZ" says 1 "new.spz: SPZ of version 4 or later" "$build/view" "$out/new.spz"
check "unbake a model" says 1 "takes light as it is" "$build/unbake" "$model" -o "$out/lit2.ply"
check "and writes nothing" test ! -e "$out/lit2.ply"
check "unbake onto itself" says 1 "baked.ply" "$build/unbake" "$out/baked.ply" -o "$out/baked.ply"
check "unbake nothing" says 1 "no.ply" "$build/unbake" "$out/no.ply" -o "$out/lit2.ply"
for wrong in "--ambient 1,1" "--ambient 1,1,1," "--ambient -1,1,1" "--medium nan,1" "--roughness" "--lit 1" "more.ply"; do
    check "unbake $wrong" says 2 "^usage: unbake" "$build/unbake" "$out/baked.ply" -o "$out/lit2.ply" $wrong
done
check "unbake --keep 2" says 1 "kept = 2 is not within 0 .. 1" "$build/unbake" "$out/baked.ply" -o "$out/lit2.ply" --keep 2
check "unbake --roughness 2" says 1 "roughness" "$build/unbake" "$out/baked.ply" -o "$out/lit2.ply" --roughness 2
check "unbake --f0 2" says 1 "f0 is not above 0, up to 1: 2" "$build/unbake" "$out/baked.ply" -o "$out/lit2.ply" --f0 2
{
    printf 'ply\nformat ascii 1.0\nelement vertex 1\n'
    for p in x y z f_dc_0 f_dc_1 f_dc_2 f_rest_0 f_rest_1 f_rest_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3; do echo "property float $p"; done
    printf 'end_header\n0 0 0 0 0 0 1 1 1 2 -2 -2 -3 1 0 0 0\n'
} >"$out/rest.ply"
check "unbake says what it leaves out" says 0 "f_rest is left out" "$build/unbake" "$out/rest.ply" -o "$out/lit2.ply" --keep 1
check "and not that light changes nothing" lacks "change nothing"

rm -rf "$out"
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
