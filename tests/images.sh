#!/bin/sh
# usage: images.sh BUILD: how examples/images.h reads images that other programs wrote, beside what these make of them. A
# program or profile that is missing is named, and what needs it left out. Closes with "N passed, N failed".
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
if has identify && [ -n "$srgb" ]; then # of ImageMagick
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

if has cjpeg && has djpeg && has jpegtran; then # of libjpeg-turbo: the same numbers, a 255th apart if anything
    same() { # same FILE.jpg
        djpeg -rgb -pnm "$1" >"$work/want.pnm" && "$build/pixels" --bytes "$1" >"$work/read.pnm" && cmp -s "$work/read.pnm" "$work/want.pnm"
    }
    seed=1
    for size in 1x1 1x2 3x3 5x4 9x17 34x3 33x21 70x50; do
        seed=$((seed + 1))
        LC_ALL=C awk -v size=$size -v s=$seed 'BEGIN { split(size, n, "x"); print "P3", n[1], n[2], 255; for (i = 0; i < n[1] * n[2]; i++) {
            x = i % n[1]; y = int(i / n[1]); for (c = 0; c < 3; c++) { s = (s * 16807 + 12345) % 2147483647
            v = 128 + 90 * sin(x * (0.13 + 0.05 * c) + y * 0.09) + (int(x / 7) % 2 ? 60 : -20) + s % 41 - 20
            printf "%d ", (v < 0 ? 0 : v > 255 ? 255 : v) } print "" } }' >"$work/random.ppm"
        for sampling in 1x1 2x1 2x2 1x2 4x1 1x4 3x1 4x2 2x2,1x1,2x1 2x1,1x2,1x1; do
            wrong=0
            for quality in 5 90; do
                for options in "" "-progressive" "-restart 1B" "-progressive -restart 2B -smooth 20" "-optimize -grayscale" "-rgb"; do
                    cjpeg -quality $quality -sample $sampling $options -outfile "$work/random.jpg" "$work/random.ppm" 2>/dev/null &&
                        same "$work/random.jpg" || { wrong=1; echo "    $size $sampling $quality $options"; }
                done
            done
            [ $wrong -eq 0 ]
            count "libjpeg-turbo: $size $sampling"
        done
    done
    cjpeg -quality 90 -sample 2x2 "$work/random.ppm" >"$work/a.jpg"
    jpegtran -arithmetic "$work/a.jpg" >"$work/arithmetic.jpg"
    "$build/pixels" "$work/arithmetic.jpg" 2>&1 >/dev/null | grep -q "arithmetic codes cannot be read: repack" &&
        jpegtran "$work/arithmetic.jpg" >"$work/b.jpg" && cmp -s "$work/a.jpg" "$work/b.jpg"
    count "jpegtran: what an error advises"
    jpegtran -progressive -rotate 90 "$work/a.jpg" >"$work/b.jpg" && same "$work/b.jpg"
    count "jpegtran: rotated"
    if has identify; then
        for options in "-sampling-factor 4:2:0" "-sampling-factor 4:1:1" "-interlace JPEG" "-colorspace Gray" "-quality 100" "-density 72x72"; do
            convert "$work/random.ppm" $options "$work/c.jpg" && same "$work/c.jpg" && notes "$work/c.jpg" ""
            count "ImageMagick: $options"
        done
        convert "$work/random.ppm" -colorspace CMYK "$work/cmyk.jpg"
        "$build/pixels" "$work/cmyk.jpg" 2>&1 >/dev/null | grep -q "CMYK cannot be read" && convert "$work/cmyk.jpg" -colorspace sRGB "$work/rgb.png" &&
            "$build/pixels" "$work/rgb.png" >/dev/null
        count "ImageMagick: what an error advises"
        if [ -f "$icc/compatibleWithAdobeRGB1998.icc" ] && [ -n "$srgb" ]; then
            convert "$work/in.ppm" -depth 8 -profile "$icc/compatibleWithAdobeRGB1998.icc" -quality 100 -sampling-factor 4:4:4 "$work/c.jpg" &&
                convert "$work/c.jpg" -depth 16 -intent relative -profile "$srgb" -type truecolor -compress none "$work/want.ppm" &&
                light "$work/c.jpg" "$work/want.ppm" srgb 0.001 && notes "$work/c.jpg" "not sRGB (ICC profile)"
            count "ImageMagick: JPEG in Adobe's RGB"
        fi
    fi
    if has exiftool; then
        rm -f "$work/turned.jpg"
        exiftool -q -q -n -Orientation=6 -o "$work/turned.jpg" "$work/a.jpg"
        same "$work/turned.jpg" && notes "$work/turned.jpg" "(EXIF's orientation 6)"
        count "exiftool: orientation of JPEG"
    fi
fi

wanted() { # wanted FILE CHANNELS: in want.txt, the light that oiiotool finds in these
    rm -f "$work/want.exr"
    oiiotool "$1" --ch "$2" --croptofull -d float -o "$work/want.exr" &&
        oiiotool --info --dumpdata "$work/want.exr" | sed -n 's/^ *Pixel (\([0-9]*\), \([0-9]*\)): /\1 \2 /p' >"$work/want.txt"
}
exr() { # exr FILE: it has the light that was wanted, alpha divided out, within halves' rounding
    "$build/pixels" "$1" >"$work/read.txt" || return 1
    awk '
        FNR == NR { for (c = 3; c <= 6; c++) want[$1, $2, c] = $c; pixels++; next }
        $1 == "note:" || NF != 6 || $0 ~ /[a-z]/ { next }
        { alpha = want[$1, $2, 6]
          for (c = 3; c <= 6; c++) {
              v = c == 6 ? alpha : alpha > 0 ? want[$1, $2, c] / alpha : 0
              if (v < 0) v = 0
              if (c < 6 && v > 65504) v = 65504
              off = v - $c; if (off < 0) off = -off
              off /= 6e-4 + v # six digits are printed
              if (off > worst) worst = off }
          seen++ }
        END { if (seen != pixels || !seen || worst > 1e-3) { print "    " seen " of " pixels " pixels, off by " worst; exit 1 } }' \
        "$work/want.txt" "$work/read.txt"
}
if has oiiotool && has exrmaketiled; then
    # spread: more than 2^14 halves in a block, of which PIZ then makes other differences
    for row in 1x1:constant 3x5:smooth 33x31:smooth 33x31:constant 33x31:steps 100x70:noise 1030x40:spread; do
        size=${row%:*}
        case ${row#*:} in
        smooth) pattern=fill:topleft=0.1,0.2,0.3,1:topright=2,0.1,0.9,0.5:bottomleft=0.7,0.01,4,1:bottomright=0.1,0.2,0.3,0.8 ;;
        constant) pattern=constant:color=0.25,0.5,0.75,1 ;;
        steps) pattern=checker:width=5:height=3:color1=0.1,0.2,0.3,1:color2=0.7,0.1,0.4,0.5 ;;
        noise) pattern=noise:type=uniform:min=0.1:max=0.9:mono=0 ;;
        spread) pattern=noise:type=uniform:min=0.9:max=2:mono=0 ;;
        esac
        for type in half float; do
            set -- --pattern $pattern $size 3
            [ $size = 1030x40 ] && set -- "$@" --powc 15
            rm -f "$work/none.exr" "$work/piz.exr" "$work/pxr24.exr"
            oiiotool "$@" -d $type --compression none -o "$work/none.exr" --compression piz -o "$work/piz.exr" --compression pxr24 -o "$work/pxr24.exr" &&
                wanted "$work/none.exr" R,G,B,A=1
            count "oiiotool: $row $type"
            for packing in piz pxr24; do
                rm -f "$work/tiles.exr"
                exr "$work/$packing.exr"
                count "OpenEXR: $packing $row $type"
                exrmaketiled -m -t 32 24 -z $packing "$work/none.exr" "$work/tiles.exr" && exr "$work/tiles.exr"
                count "OpenEXR: $packing tiles $row $type"
            done
        done
    done
    smooth=fill:topleft=0.1,0.2,0.3,1:topright=0.5,0.1,0.2,0.5:bottomleft=0.7,0.01,4,1:bottomright=0.1,0.2,0.3,0.8
    oiiotool --pattern $smooth 50x40 4 --origin -7+9 --fullsize 45x50+0+0 -d half --compression piz -o "$work/windows.exr"
    wanted "$work/windows.exr" R,G,B,A && exr "$work/windows.exr" && notes "$work/windows.exr" ""
    count "OpenEXR: windows"
    oiiotool --pattern $smooth 50x40 4 --chnames id.R,id.G,id.B,id.A -o "$work/id.exr"
    oiiotool --pattern $smooth 50x40 4 "$work/id.exr" --chappend -d half -d id.R=uint -d id.G=uint --compression piz -o "$work/ids.exr"
    wanted "$work/ids.exr" R,G,B,A && exr "$work/ids.exr"
    count "OpenEXR: whole numbers beside"
    oiiotool --pattern constant:color=0.5,0.5,0.5 50x40 3 --chnames N.R,N.G,N.B --pattern $smooth 50x40 4 --chnames b.R,b.G,b.B,b.A --chappend \
        -d half --compression piz -o "$work/layers.exr"
    wanted "$work/layers.exr" b.R,b.G,b.B,b.A && exr "$work/layers.exr" && notes "$work/layers.exr" "made of 2 layers or parts with R, G, B: b is taken"
    count "OpenEXR: a normal pass before beauty"
    oiiotool --pattern constant:color=0.5 50x40 1 --chnames Z -d float -o "$work/depth.exr"
    oiiotool --pattern $smooth 50x40 4 -d half --compression piz -o "$work/rgba.exr"
    rm -f "$work/parts.exr"
    exrmultipart -combine -i "$work/depth.exr" "$work/rgba.exr" -o "$work/parts.exr" >/dev/null
    "$build/pixels" "$work/rgba.exr" >"$work/a.txt" && "$build/pixels" "$work/parts.exr" | cmp -s - "$work/a.txt"
    count "OpenEXR: parts, depth before light"
    oiiotool --pattern $smooth 50x40 4 --unpremult --mulc 1,1,1,0 -d half -o "$work/straight.exr"
    notes "$work/straight.exr" "bright where alpha is 0"
    count "OpenEXR: straight alpha"
    oiiotool --pattern $smooth 50x40 4 --attrib Orientation 6 --attrib PixelAspectRatio 2.0 -d half -o "$work/turned.exr"
    notes "$work/turned.exr" "(OpenEXR's Orientation 6)" && notes "$work/turned.exr" "(pixelAspectRatio 2)"
    count "OpenEXR: Orientation, pixelAspectRatio"
    if has exrmultiview; then
        oiiotool --pattern constant:color=0.1,0.2,0.3 50x40 3 -d half -o "$work/right.exr"
        exrmultiview left "$work/rgba.exr" right "$work/right.exr" "$work/views.exr" && wanted "$work/views.exr" R,G,B,A &&
            exr "$work/views.exr" && notes "$work/views.exr" "the one without a name is taken"
        count "OpenEXR: views"
    fi
    if has exr2aces; then # the colours of wide gamut are bright ones of sRGB: what was there comes back
        exr2aces "$work/rgba.exr" "$work/aces.exr" >/dev/null && notes "$work/aces.exr" "of other primaries (chromaticities)" &&
            "$build/pixels" "$work/aces.exr" | awk 'FNR == NR { for (c = 3; c <= 6; c++) want[$1, $2, c] = $c; next } $1 == "note:" { next }
                { for (c = 3; c <= 6; c++) { off = want[$1, $2, c] - $c; if (off < 0) off = -off; if (off > 3e-3 + 2e-3 * want[$1, $2, c]) bad++ } seen++ }
                END { if (bad || seen != 2000) { print "    " bad " of " seen; exit 1 } }' "$work/a.txt" -
        count "exr2aces"
    fi
fi
if has darktable-cli && has oiiotool; then
    oiiotool "$work/in.ppm" -d uint16 -o "$work/dark.png"
    rm -f "$work/dark.exr"
    darktable-cli "$work/dark.png" "$work/dark.exr" --icc-type LIN_REC709 --core --configdir "$work/darktable" >/dev/null 2>&1 &&
        wanted "$work/dark.exr" R,G,B,A=1 && exr "$work/dark.exr"
    count "darktable: PIZ"
fi
if has blender && has oiiotool; then
    cat >"$work/layers.py" <<END
import bpy
scene, layer = bpy.context.scene, bpy.context.view_layer
scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = 'CYCLES', 1, False
scene.render.resolution_x, scene.render.resolution_y, scene.render.film_transparent = 48, 32, True
layer.use_pass_ambient_occlusion = layer.use_pass_normal = True
for codec in 'PIZ', 'ZIP', 'PXR24':
    scene.render.image_settings.file_format = 'OPEN_EXR_MULTILAYER'
    scene.render.image_settings.exr_codec = codec
    scene.render.filepath = '$PWD/$work/blender_' + codec + '.exr'
    bpy.ops.render.render(write_still=True)
END
    blender -b --factory-startup -P "$work/layers.py" >"$work/blender.log" 2>&1
    for codec in PIZ ZIP PXR24; do
        wanted "$work/blender_$codec.exr" ViewLayer.Combined.R,ViewLayer.Combined.G,ViewLayer.Combined.B,ViewLayer.Combined.A &&
            exr "$work/blender_$codec.exr" &&
            notes "$work/blender_$codec.exr" "made of 2 layers or parts with R, G, B: ViewLayer.Combined is taken"
        count "Blender: $codec"
    done
fi
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
