#!/bin/sh
# usage: sh tests/capture.sh WORK [options of tests/blender.py]: renders a capture by two phones into WORK (blender.py says of what), lets
# COLMAP find the cameras, from WORK/images alone, and says how far they are from the truth. What is there is not made again. COLMAP's
# model: WORK/sparse/0, and as text beside it; PINHOLE cameras or, of photographs by a distorted lens, OPENCV, one of each phone. WORK/aligned:
# the same in the truth's coordinates. Needs Blender, python3-numpy, COLMAP, and on two cores an hour or two.
set -eu
work=$1 here=$(dirname "$0")
shift
export QT_QPA_PLATFORM=offscreen
quiet() { "$@" >"$work/log" 2>&1 || { tail -n 20 "$work/log"; exit 1; }; }
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
echo "models: $(ls "$work/sparse" | grep -c '^[0-9]*$')"
colmap model_converter --input_path "$work/sparse/0" --output_path "$work/sparse/0" --output_type TXT
colmap model_analyzer --path "$work/sparse/0"
python3 -c 'import json, sys
for f in json.load(open(sys.argv[1]))["frames"]: print(f["file"], *(row[3] for row in f["camera_to_world"][:3]))' "$work/truth.json" >"$work/centres.txt"
mkdir -p "$work/aligned"
colmap model_aligner --input_path "$work/sparse/0" --output_path "$work/aligned" --ref_images_path "$work/centres.txt" --ref_is_gps 0 \
    --alignment_type custom --robust_alignment 0
