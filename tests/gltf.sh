#!/bin/sh
# usage: gltf.sh BUILD [install]: an exported GLB before Khronos' validator, gltf-validator of npm. It does not know the attributes of
# KHR_gaussian_splatting, which is no fault of the file's; one with a wrong mode must be one. Closes with "N passed, N failed".
set -u
build=$1 work=$1/gltf passed=0 failed=0
check() { # check NAME COMMAND...
    name=$1; shift
    if "$@"; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "failed: $name"; fi
}
mkdir -p "$work"
[ -d "$work/node_modules/gltf-validator" ] || npm install --silent --no-audit --no-fund --fetch-timeout=20000 --fetch-retries=0 --prefix "$work" gltf-validator >/dev/null || {
    echo "npm has no gltf-validator"; exit 2; }
[ "${2:-}" != install ] || exit 0
faults() { # faults FILE: how many errors and warnings it has
    NODE_PATH=$work/node_modules node -e '
        require("gltf-validator").validateBytes(new Uint8Array(require("fs").readFileSync(process.argv[1]))).then(report => {
            const known = /^\/meshes\/0\/primitives\/0\/attributes\/KHR_gaussian_splatting:/
            const faults = report.issues.messages.filter(m => m.severity < 2 && !(m.code == "MESH_PRIMITIVE_INVALID_ATTRIBUTE" && known.test(m.pointer)))
            faults.forEach(m => console.error(m.code, m.pointer, m.message))
            console.log(faults.length)
        }).catch(error => console.log(error))' "$1"
}
model=$work/model.ply
check "a model" sh -c "\"$build/train\" examples/data/waxcow -o \"$model\" --iterations 30 --points 300 >/dev/null"
for option in "" --keep; do
    check "export $option" sh -c "\"$build/export\" \"$model\" \"$work/splats\" $option >/dev/null"
    check "a valid GLB $option" test "$(faults "$work/splats.glb")" = 0
done
LC_ALL=C sed 's/"mode":0/"mode":9/' "$work/splats.glb" >"$work/wrong.glb"
check "a wrong one is found out" test "$(faults "$work/wrong.glb" 2>/dev/null)" != 0
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
