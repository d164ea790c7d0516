#!/bin/sh
# usage: images.sh BUILD: how examples/olat.h reads images that other programs wrote, beside what these make of them; `make BUILD/pixels`
# comes first. A program or profile that is missing is named, and what needs it left out. Closes with "N passed, N failed".
set -u
build=$1 work=$1/images passed=0 failed=0
mkdir -p "$work"
has() { # has TOOL: else says so
    command -v "$1" >/dev/null && return
    echo "$1 is missing: not tested"
    return 1
}
count() { # count NAME: the last command as a check
    if [ $? -eq 0 ]; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "failed: $1"; fi
}
notes() { # notes FILE WORDS: the reader's notes have them; "": there are none
    found=$("$build/pixels" "$1" | sed -n 's/^note: //p')
    case $2/$found in
    /) ;;
    /*) echo "    $found"; false ;;
    *) printf '%s' "$found" | grep -qF "$2" || { echo "    not \"$2\": $found"; false; } ;;
    esac
}
light() { # light FILE REFERENCE.ppm CURVE MOST: as light it differs from the plain PPM, of words on that curve, by no more than MOST
    "$build/pixels" "$1" >"$work/read.txt" || return 1
    awk -v curve="$3" -v most="$4" '
        FNR == NR { if ($0 !~ /^#/) for (i = 1; i <= NF; i++) word[n++] = $i; next }
        $1 == "note:" { next }
        { for (c = 0; c < 3; c++) {
              v = word[4 + 3 * ($2 * word[1] + $1) + c] / word[3]
              if (curve == "srgb") v = v <= 0.04045 ? v / 12.92 : ((v + 0.055) / 1.055) ^ 2.4
              off = v - $(3 + c); if (off < 0) off = -off
              if (off > worst) worst = off
              seen++ } }
        END { if (seen != 3 * word[1] * word[2] || worst > most) { print "    " seen " values, off by " worst; exit 1 } }' "$2" "$work/read.txt"
}
# random colours of 16 x 16 pixels, greys first
awk 'BEGIN { print "P3 16 16 65535"; for (i = 0; i < 256; i++) { for (c = 0; c < 3; c++) { s = (s * 16807 + 12345) % 2147483647
    printf "%d ", i < 16 ? i * 4369 : s % 65536 } print "" } }' >"$work/in.ppm"

icc=/usr/share/color/icc # of icc-profiles-free and libgs-common
srgb=
for profile in ghostscript/srgb.icc sRGB.icc; do [ -n "$srgb" ] || [ ! -f "$icc/$profile" ] || srgb=$icc/$profile; done
[ -n "$srgb" ] || echo "sRGB.icc is missing in $icc: profiles not tested"
if has convert && [ -n "$srgb" ]; then
    for row in "sRGB.icc:" "ghostscript/srgb.icc:" "compatibleWithAdobeRGB1998.icc:not sRGB (ICC profile)" "ghostscript/a98.icc:not sRGB" \
        "LStar-RGB.icc:not sRGB" "ghostscript/rommrgb.icc:colours that sRGB does not hold" "ghostscript/esrgb.icc:not sRGB" \
        "ghostscript/scrgb.icc:is linear (ICC profile): converted to the sRGB curve"; do
        name=${row%%:*} file=$work/$(echo "$name" | tr / _).png
        [ -f "$icc/$name" ] || { echo "$name is missing: not tested"; continue; }
        convert "$work/in.ppm" -depth 16 -profile "$icc/$name" "$file" &&
            convert "$file" -intent relative -profile "$srgb" -depth 16 -type truecolor -compress none "$work/want.ppm" &&
            light "$file" "$work/want.ppm" srgb 0.001 && notes "$file" "${row#*:}"
        count "ImageMagick: $name"
        for tool in oiiotool pngcrush ffmpeg; do # what others pass on
            out=$work/$tool.png
            rm -f "$out"
            case $tool in
            oiiotool) has $tool && oiiotool "$file" -o "$out" ;;
            pngcrush) has $tool && pngcrush -q "$file" "$out" 2>/dev/null ;;
            ffmpeg) has $tool && ffmpeg -y -loglevel error -i "$file" "$out" ;;
            esac || continue
            light "$out" "$work/want.ppm" srgb 0.001
            count "ImageMagick, $tool: $name"
        done
    done
fi
if has oiiotool; then
    oiiotool "$work/in.ppm" --attrib oiio:ColorSpace Linear -d uint16 -o "$work/linear.png"
    light "$work/linear.png" "$work/in.ppm" linear 0.0001 && notes "$work/linear.png" "is linear (gAMA 1)"
    count "oiiotool: linear"
    oiiotool "$work/in.ppm" --attrib oiio:ColorSpace sRGB -d uint16 -o "$work/srgb.png"
    light "$work/srgb.png" "$work/in.ppm" srgb 0.0001 && notes "$work/srgb.png" ""
    count "oiiotool: sRGB"
    if has exiftool; then
        rm -f "$work/turned.png"
        exiftool -q -q -n -Orientation=6 -o "$work/turned.png" "$work/srgb.png"
        light "$work/turned.png" "$work/in.ppm" srgb 0.0001 && notes "$work/turned.png" "(eXIf orientation 6)"
        count "exiftool: orientation"
    fi
fi
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
