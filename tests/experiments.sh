#!/bin/sh
# The paper's experiments with this library, and others: sh tests/experiments.sh BUILD DATA ITERATIONS SCENE:BACKGROUND...
# Writes BUILD/experiments/EXPERIMENTS.md: the tables, between the head and the findings of tests/EXPERIMENTS.md.
# PARTS="FUNCTION..." makes those sections alone and keeps the others. A run of the same commit, data and options is not repeated.
# Runs go side by side, one thread and one core each: LIST=1 makes this script name its runs on descriptor 3, and RUN=1 do one of
# them: BUILD DATA ITERATIONS SCENE:BACKGROUND NAME OPTION...
set -eu
build=$1 data=$2 iterations=$3
shift 3
scenes="$*" out=$build/experiments commit=$(git rev-parse --short HEAD 2>/dev/null || echo unknown)
mkdir -p "$out"

# run SCENE:BACKGROUND NAME OPTION...: trains and tests; leaves the path of its log in $log.
run() {
    scene=${1%%:*} background=${1##*:} name=$2
    [ -z "${LIST-}" ] || { echo "$*" >&3; log=/dev/null; return; }
    shift 2
    log=$out/$scene.$name.log
    key="$commit $iterations $background $data $*"
    if ! grep -qxF "run $key" "$log" 2>/dev/null; then
        echo "$scene: $name $*" >&2
        "$build/train" "$data/$scene" -o "$out/$scene.$name.ply" --background "$background" --iterations "$iterations" --threads 1 \
            "$@" >"$log.part" 2>"$log.err" || { cat "$log.err" >&2; exit 1; }
        echo "run $key" >>"$log.part"
        mv "$log.part" "$log"
    fi
}
if [ -n "${RUN-}" ]; then run "$@"; exit; fi

# PSNR and SSIM of the log's line that begins with $1.
psnr() { sed -n "s/^$1: PSNR \([0-9.]*\) .*/\1/p" "$log"; }
ssim() { sed -n "s/^$1: PSNR .* SSIM \([0-9.]*\) .*/\1/p" "$log"; }

# head_line FIRST_COLUMN PAPER_COLUMN
head_line() {
    printf '\n| %s | %s |' "$1" "$2"
    for s in $scenes; do printf ' %s |' "${s%%:*}"; done
    printf ' options |\n| --- | --- |'
    for s in $scenes; do printf ' --- |'; done
    printf ' --- |\n'
}

# row LABEL PAPER NAME OPTION...: test PSNR (training PSNR) and time of every scene
row() {
    label=$1 paper=$2 name=$3
    shift 3
    line="| $label | $paper |"
    for s in $scenes; do
        case "$*" in *disturbed.json*) [ -f "$data/${s%%:*}/transforms_train_disturbed.json" ] || { line="$line - |"; continue; } ;; esac
        run "$s" "$name" "$@"
        line="$line $(psnr test) ($(psnr training)), $(sed -n 's/.*trained in \([0-9:]*\),.*/\1/p' "$log") |"
    done
    echo "$line ${*:+\`$*\`} |"
}

# details NAME OPTION...: what one configuration costs
details() {
    name=$1
    shift
    printf '\n| scene | test PSNR | SSIM | FLIP | training PSNR | Gaussians | time | memory |\n'
    printf '| --- | --- | --- | --- | --- | --- | --- | --- |\n'
    for s in $scenes; do
        run "$s" "$name" "$@"
        cost=$(sed -n 's/.*: \([0-9]*\) Gaussians, trained in \([0-9:]*\), peak memory \([0-9]* MiB\).*/\1 | \2 | \3/p' "$log")
        echo "| ${s%%:*} | $(psnr test) | $(ssim test) | $(sed -n 's/^test: .* FLIP \([0-9.]*\) .*/\1/p' "$log") |" \
            "$(psnr training) | $cost |"
    done
}

# sheet LABEL NAME: photograph, rendering, diffuse, specular, scattering, shadow, normals of four test views, of each scene; the
# first scene's is shown.
sheet() {
    for s in $scenes; do
        scene=${s%%:*}
        [ "$out/$scene.$2.png" -nt "$out/$scene.$2.ply" ] || look relight "$out/$scene.$2.ply" "$data/$scene" \
            --background "${s##*:}" --out "$out/frames" --sheet "$out/$scene.$2.png" >&2
    done
    image "$1" "$2"
}

# look PROGRAM OPTION...: at runs that are done
look() {
    program=$1
    shift
    [ -n "${LIST-}" ] || "$build/$program" "$@"
}

# image LABEL NAME: puts BUILD/experiments/SCENE.NAME.png of the first scene into the text.
image() {
    mkdir -p "$out/images"
    [ -n "${LIST-}" ] || cp "$out/${scenes%%:*}.$2.png" "$out/images"
    printf '\n%s:\n\n![%s](images/%s)\n' "$1" "$1" "${scenes%%:*}.$2.png"
}

# show NAME KIND MODEL_NAME...: a picture of every scene by tests/show.c
show() {
    name=$1 kind=$2
    shift 2
    for s in $scenes; do
        models=
        for m in "$@"; do models="$models $out/${s%%:*}.$m.ply"; done
        look show "$kind" "$out/${s%%:*}.$name.png" "$data/${s%%:*}" "${s##*:}" $models >&2
    done
}

default_configuration() { details default; }

published_configuration() { details published --preset published; }

error_parts() {
    printf '\nPercent of the squared error of the test views, on percent of the pixels. Outlines: within 2 px of where the\n'
    printf "photograph's alpha changes. Shadow edges: of where the rendering's S does. Highlights: what is too dark by 10 of 255\n"
    printf 'where the photograph is brighter than 64 in all channels. Lit, half lit, dark: S above 0.7, between, below 0.3.\n'
    printf '\n| scene | PSNR of all pixels | outlines | shadow edges | highlights | lit | half lit | dark | background |\n'
    printf '| --- | --- | --- | --- | --- | --- | --- | --- | --- |\n'
    for s in $scenes; do
        run "$s" default
        echo "| ${s%%:*} | $(look show parts "$data/${s%%:*}" "${s##*:}" "$out/${s%%:*}.default.ply")"
    done
}

components() {
    head_line 'terms' paper
    row 'A: diffuse' '20.07 (20.92)' a --terms diffuse
    row 'B: diffuse, specular' '20.17 (21.17)' b --terms diffuse,specular
    row 'C: diffuse, specular, scattering: no shadow' '22.88 (23.82)' c --terms diffuse,specular,scattering
    row 'D: all' '33.29 (34.69)' default
    row 'E: all but specular' '31.64 (32.06)' e --terms diffuse,shadow,scattering
    row 'F: all but scattering' '32.10 (32.60)' f --terms diffuse,specular,shadow
}

schedules() {
    head_line 'order' paper
    row 'H: all from the start' '31.72 (32.17)' joint --schedule joint
    row 'I: diffuse, shadow, scattering, specular' '33.29 (34.69)' progressive --schedule progressive
    row 'J: last two swapped' '32.08 (32.71)' swapped --schedule swapped
    row 'K: all after diffuse' '32.74 (33.52)' default
    printf '\nPhotograph, rendering, diffuse, specular, scattering, shadow, normals (as Figures 5 and 12; the other scenes'\''\n'
    printf 'are in build/experiments).\n'
    sheet 'H, all from the start' joint
    sheet 'I, diffuse, shadow, scattering, specular' progressive
    sheet 'J, last two swapped' swapped
    sheet 'K, all after diffuse' default
}

shadow_on_scattering() {
    head_line 'shadow on' 'paper (9 scenes)'
    row 'diffuse and specular' '33.00 (34.37)' default
    row 'all terms' '32.13 (33.14)' shadow_on_scattering --set shadow_on_scattering=1
    sheet 'Shadow on all terms (above, under K, on diffuse and specular)' shadow_on_scattering
    show backlit backlit default shadow_on_scattering
    image 'A photograph lit from behind, shadow on diffuse and specular, on all terms (as Figure 13)' backlit
}

refinement() {
    head_line 'training' 'paper (SSS-GS scenes, its own noise)'
    row 'true poses and lights' '' default
    row 'disturbed' '37.44' disturbed --train-json transforms_train_disturbed.json
    row 'disturbed, refined' '38.35' refined --train-json transforms_train_disturbed.json --refine
    printf '\n| scene | test, each pose and light fitted to its photograph | cameras (the object in the picture, length, angle), lights (length): disturbed | refined |\n'
    printf '| --- | --- | --- | --- |\n'
    for s in $scenes; do
        scene=${s%%:*}
        [ -f "$data/$scene/transforms_train_disturbed.json" ] || continue
        run "$s" refined --train-json transforms_train_disturbed.json --refine
        echo "| $scene | $(psnr 'test (each.*)') |" \
            "$(look show poses "$data/$scene/transforms_train.json" "$data/$scene/transforms_train_disturbed.json") |" \
            "$(look show poses "$data/$scene/transforms_train.json" "$out/$scene.refined.ply.refined.json") |"
    done
}

sweeps() {
    show pipeline pipeline default
    image 'What the light leaves behind the object, coarse visibility, refined shadow, rendering (as Figure 3)' pipeline
    show sweeps sweeps default
    image 'One view under six lights, six views under one light, none of them in training (as Figure 10)' sweeps
    for s in $scenes; do
        scene=${s%%:*} frames=
        look relight "$out/$scene.default.ply" "$data/$scene" --trajectory --background "${s##*:}" --out "$out/$scene.trajectory" >&2
        for i in 0000 0030 0060 0090 0120 0165 0195 0225 0255 0285 0315 0345 0375 0405 0435 0465; do
            frames="$frames $out/$scene.trajectory/$i.png"
        done
        look show strip "$out/$scene.trajectory.png" 8 $frames >&2
    done
    image 'The path of Appendix D: the light goes round, the camera to the back, the light round again, the camera returns' trajectory
}

dipoles() {
    head_line 'form' paper
    row 'Jensen et al. 2001' '' default
    row 'eq. 5 as printed' '' printed --set dipole=1
}

changes() {
    head_line 'change' paper
    row none '' default
    row 'stored values instead of linear light' '' stored --transfer none
    row 'a specular term per Gaussian' '' geometric --set asg=0
    row "normals not drawn to the depth's" '' no_normals --set normal_weight=0
    row 'a depth cue' '' cue --set depth_cue=1
    row 'one optics for all channels' '' one_optics --set per_channel_optics=0
    row 'plain shadow network' '' plain_shadow --set residual_shadow=0
    row 'four octaves of wo and wi' '' octaves --set view_octaves=4 --set light_octaves=4
    row 'no shadow network' '' no_shadow_net --set shadow_layers=0
    row 'no light bias' '' no_bias --set light_bias=0
    row 'no transport' '' no_transport --set transport=0
    row 'camera pass adds 0.3 px^2' '' variance --set pixel_variance=0.3
    row 'scattering network 64 wide' '' narrow --set scattering_width=64
}

# part FUNCTION TITLE: a section; where PARTS does not name it, the one that tests/EXPERIMENTS.md has.
part() {
    case " ${PARTS-$1} " in
        *" $1 "*)
            printf '\n## %s\n\nCommit %s, %s iterations, %s.\n' "$2" "$commit" "$iterations" "${cpu:-unknown CPU}"
            "$1" ;;
        *) echo; TITLE="## $2" awk '/^## / { inside = $0 == ENVIRON["TITLE"] } inside' tests/EXPERIMENTS.md | sed '$ { /^$/d; }' ;;
    esac
}

text=$out/EXPERIMENTS.md.part
if [ -n "${LIST-}" ]; then
    text=/dev/null
else
    LIST=1 sh "$0" "$build" "$data" "$iterations" "$@" 3>&1 >/dev/null | sort -u |
        RUN=1 xargs -P "$(getconf _NPROCESSORS_ONLN)" -r -L 1 sh "$0" "$build" "$data" "$iterations"
fi
cpu=$(sed -n 's/^model name[[:space:]]*: //p' /proc/cpuinfo 2>/dev/null | sed 1q)
{
    sed '/^## /,$d' tests/EXPERIMENTS.md | sed '$d'
    part default_configuration 'Default configuration'
    part error_parts 'Where the squared error lies'
    part published_configuration 'Published configuration (--preset published)'
    part components 'Reflectance components (Tables 2 and 4)'
    part schedules 'Training schedules (Tables 2 and 4)'
    part shadow_on_scattering 'Shadow also on scattering (eq. 14, Table 5)'
    part refinement 'Disturbed cameras and lights'
    part sweeps 'Shadows, lights, views'
    part dipoles 'Dipole forms and profiles'
    part changes 'The default configuration, one change at a time'
    echo
    sed -n '/^## Findings/,$p' tests/EXPERIMENTS.md
} >"$text"
[ -z "${LIST-}" ] || exit 0
mv "$text" "$out/EXPERIMENTS.md"
echo "$out/EXPERIMENTS.md"
