#!/bin/sh
# usage: sh tests/lines.sh [print]: has a section of ssdgs.h grown by more than a twentieth over its budget in tests/lines.txt, or all by more
# than a hundredth? A change that needs more says why, and writes the file anew with "print". Also: the manual's form, and what messages format.
count() {
    awk '/^\/\* ==== / { name = $3 == "the" ? "interface" : $3 } { n[name == "" ? "manual" : name]++; if (!(name in seen)) order[k++] = name; seen[name] }
        END { for (i = 0; i < k; i++) { name = order[i] == "" ? "manual" : order[i]; print name, n[name] }; print "all", NR }' ssdgs.h
}
[ "${1-}" = print ] && { count >tests/lines.txt; exit; }
awk '/^\/\* ==== / { exit } /^DO THIS/ { on = 1 } on && /^[a-z(]/ { print "ssdgs.h:" NR ": the manual is indented, but for its headings"; bad = 1 } END { exit bad }' ssdgs.h || exit 1
grep -n '"[^"]*%[^sdgz%"]' ssdgs.h | grep -v 'snprintf(\|__asm__' && { echo "messages know %s, %d, %zu and %g"; exit 1; }
count | awk 'NR == FNR { budget[$1] = $2; next }
    !($1 in budget) || $2 > ($1 == "all" ? 1.01 : 1.05) * budget[$1] { print "tests/lines.txt gives " $1 " " budget[$1] + 0 " lines, it has " $2; failed = 1 }
    END { exit failed }' tests/lines.txt -
