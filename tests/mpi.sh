#!/bin/sh
# usage: mpi.sh BUILD_DIR: examples/train_mpi on one, two and four processes comes to the same bytes. Closes with "N passed, N failed".
build=$1 out=$1/mpi_files
passed=0 failed=0
check() { # check NAME COMMAND...
    name=$1; shift
    if "$@"; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "failed: $name"; sed 's/^/    /' "$out/log"; fi
}
run() { # run CODE PROCESSES ARGUMENTS...
    code=$1 processes=$2; shift 2
    OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1 \
        mpirun --bind-to none --oversubscribe -n "$processes" "$build/train_mpi" "$@" >"$out/log" 2>&1
    [ $? -eq "$code" ]
}
mkdir -p "$out"
for processes in 1 2 4; do
    rm -f "$out/$processes.ply"
    check "$processes processes" run 0 "$processes" examples/data/waxcow "$out/$processes.ply" 240 4
    check "$processes processes: the same bytes" cmp "$out/1.ply" "$out/$processes.ply"
done
check "three processes are refused" run 2 3 examples/data/waxcow "$out/3.ply" 240 3
check "no such folder" run 1 2 examples/data/none "$out/none.ply" 240 4
check "it says so" grep -q "examples/data/none" "$out/log"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
