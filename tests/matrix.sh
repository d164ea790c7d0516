#!/bin/sh
# sh tests/matrix.sh BUILD [NAME...]: the tests with every compiler, option and machine at hand, or the rows or groups (levels,
# standards, machines) named. Cross compilers, emulators: Debian's packages. A line each, "NAME: N passed, N failed" or
# "NAME: absent"; then, for code with FMA and without, the hashes of a rendering, a light pass and a trained model, and what gave
# them; figures at the end.
build=$1
shift
wanted=" $* "
few='t_golden t_ply t_olat' # under an emulator: minutes
all=$(cd tests && ls t_*.c | sed -e 's/\.c$//' -e '/t_gpu/d') # which is `make test-gpu`
most=$(echo "$all" | sed -e '/t_gradient/d' -e '/t_train/d') # those take unoptimised code a quarter of an hour
mkdir -p "$build/matrix"
: >"$build/matrix/hashes"
tried=0 good=0

# row NAME RUNNER TESTS CC CFLAGS: RUNNER starts a program, '' = the machine itself
row() {
    [ "$wanted" = '  ' ] || case $wanted in *" $1 "* | *" $group "*) ;; *) return ;; esac
    for tool in ${4%% *} ${2%% *}; do
        command -v "$tool" >/dev/null || { echo "$1: absent ($tool)"; return; }
    done
    tests=
    for t in $3; do tests="$tests $build/matrix/$1/$t"; done
    log=$build/matrix/$1.log
    make -j2 test BUILD="$build/matrix/$1" CC="$4" CXX="${6:-c++}" CFLAGS="$5" RUN="$2" ${tests:+TESTS="$tests" EXAMPLES=} BUILDS= >"$log" 2>&1
    code=$?
    line=$(sed -n 's/^\([0-9]* passed, [0-9]* failed\)$/\1/p' "$log" | tail -n 1)
    tried=$((tried + 1))
    case $code$line in 0*', 0 failed') good=$((good + 1)) ;; *', 0 failed') line= ;; esac # a test may not have been built
    echo "$1: ${line:-no result, see $log}"
    soak=$build/matrix/$1/t_soak
    make "$soak" BUILD="$build/matrix/$1" CC="$4" CFLAGS="$5" >>"$log" 2>&1 && $2 "$soak" full 66 2>>"$log" |
        sed -n -e 's/^hash s[a-z0-9]* /without /p' -e 's/^hash [an][a-z0-9]* /with /p' | sort -u | sed "s/\$/ $1/" >>"$build/matrix/hashes"
}

group=levels
for level in -O0 -O2 -O3 -Os '-O2 -ffast-math' '-O2 -march=native'; do
    name=$(echo "$level" | tr -d ' ')
    case $level in
        -O0) some=$most ;;
        *fast-math) some=$(echo "$all" | sed '/t_accuracy/d') ;; # see test-fastmath in the Makefile
        *) some= ;;
    esac
    row "gcc$name" '' "$some" gcc "$level"
    row "clang$name" '' "$some" clang "$level" clang++
done
group=standards
for standard in c99 c11 c17; do
    row "gcc-$standard" '' "$few" "gcc -std=$standard -pedantic-errors" -O1
    row "clang-$standard" '' "$few" "clang -std=$standard -pedantic-errors" -O1
done
for standard in c++11 c++14 c++17 c++20; do
    row "g$standard" '' "$few" "g++ -std=$standard" -O1 g++
    row "clang$standard" '' "$few" "clang++ -Wno-deprecated -std=$standard" -O1 clang++
done
group=machines
row tcc '' "$most" tcc ''
row pcc '' 't_golden t_ply' pcc ''
row musl '' "$few" 'musl-gcc -static' -O2
row i686 '' "$few" 'i686-linux-gnu-gcc -static' -O2
# t_olat asks POSIX for more; mingw names its programs *.exe, and they end their lines with \r\n
wine=$build/matrix/wine
if command -v wine >/dev/null; then
    cat >"$wine" <<'SCRIPT'
#!/bin/sh
file=$1
shift
WINEDEBUG=-all wine "$file.exe" "$@" >"$file.out"
code=$?
tr -d '\r' <"$file.out"
exit $code
SCRIPT
    chmod +x "$wine"
fi
row mingw "$wine" 't_golden t_ply t_fast t_brute' x86_64-w64-mingw32-gcc '-O2 -static'
for machine in aarch64:linux-gnu arm:linux-gnueabihf riscv64:linux-gnu s390x:linux-gnu powerpc64:linux-gnu; do
    emulator=$(echo "${machine%%:*}" | sed 's/^powerpc/ppc/')
    row "${machine%%:*}" "qemu-$emulator" "$few" "${machine%%:*}-${machine##*:}-gcc -static" -O2
done
row aarch64-clang qemu-aarch64 "$few" 'clang --target=aarch64-linux-gnu -static' '-O2 -Werror' # clang has another NEON, and warns of pragmas that it ignores
export NODE_PATH="${NODE_PATH-/usr/share/nodejs}" # where Debian's emcc has its modules, should node be another's
for level in -O2 '-O2 -msimd128' '-O3 -msimd128' '-Os -msimd128' '-O2 -msimd128 -DSSDGS_NO_SIMD' '-O2 -msimd128 -ffast-math'; do
    row "emscripten$(echo "$level" | tr -d ' ' | sed 's/-DSSDGS_NO_SIMD/-scalar/')" 'node --no-experimental-fetch' 't_golden t_fast t_brute' emcc \
        "$level -s NODERAWFS=1 -s ALLOW_MEMORY_GROWTH=1"
done
sort "$build/matrix/hashes" | awk '{ key = $1 " FMA " $2 " " $3 " " $4; if (key != last) printf "%shash %s:", last ? "\n" : "", key; last = key; printf " %s", $5 }
    END { if (NR) print "" }'
echo "figure compilers_passed $good"
echo "figure compilers_tried $tried"
[ $good -eq $tried ]
