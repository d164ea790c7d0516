#!/bin/sh
# glslangValidator 12.0.0 (Debian's glslang-tools): `pair p = i < count ? of[i] : pair(0u, 0u);`, where `of` are structures of a std430
# buffer, compiles without a word to SPIR-V that spirv-val 2023.1 refuses: the choice has the buffer's type of the structure, with offsets,
# and is stored in a variable that has the type without. The same choice as if and else is valid, and so is `pair p = of[i];`, for which
# glslang copies member by member. One would guess that a compiler's own output is valid, as the language allows both forms.
. "$(dirname "$0")/lib.sh"
debian glslangValidator glslang-tools 12.0.0
debian spirv-val spirv-tools 2023.1
shader() {
    cat >"$1.comp" <<END
#version 450
layout(local_size_x = 64) in;
struct pair { uint first, second; };
layout(std430, binding = 0) readonly buffer pairs { pair of[]; };
layout(std430, binding = 1) writeonly buffer sums { uint sum[]; };
layout(std430, binding = 2) readonly buffer sizes { uint count; };
void main() {
    uint i = gl_GlobalInvocationID.x;
    $2
    sum[i] = p.first + p.second;
}
END
    glslangValidator -V "$1.comp" -o "$1.spv" >compiled || { cat compiled; exit 1; }
    spirv-val "$1.spv" >said 2>&1 && valid=yes || valid=no
    echo "$1: compiled, valid: $valid"
    sed 's/^/    /' said
    seen="$seen $valid"
}
seen=
shader choice 'pair p = i < count ? of[i] : pair(0u, 0u);'
shader if-else 'pair p = pair(0u, 0u); if (i < count) p = of[i];'
shader copy 'pair p = of[i];'
[ "$seen" = ' no yes yes' ]
