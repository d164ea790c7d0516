#!/bin/sh
# Each script begins with this: a temporary folder to run in, gone at the end, with files.mjs and files.py in it. Then what a script may need.
set -eu
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
trap 'exit 2' HUP INT TERM
cp "$(dirname "$0")"/files.* "$work"
cd "$work"
need() { # PROGRAM PACKAGE
    command -v "$1" >/dev/null || { echo "apt-get install $2 is needed"; exit 2; }
}
debian() { # PROGRAM PACKAGE VERSION, and Python for what reads and writes its files
    need python3 python3
    need "$1" "$2"
    found=$(dpkg-query -W -f '${Version}' "$2" 2>/dev/null | sed 's/^[0-9]*://; s/[-+].*//')
    echo "$(command -v "$1"), $2 $found, pinned $3"
    [ "$found" = "$3" ] || echo "another version than the pinned one"
}
packages() { # NAME@VERSION..., of npm
    need node nodejs
    need npm npm
    echo "node $(node --version); $*"
    npm install --silent --no-audit --no-fund --ignore-scripts --prefix . "$@" >log 2>&1 || { cat log; echo "npm cannot install these"; exit 2; }
}
