#!/bin/sh
# pcc 1.2.0 (Debian's pcc): the member of an assignment's value, (k[n] = cut(..)).length, where cut() returns a structure of two words and n
# is a variable, is not the member of what was assigned: k[n].length on the next line is. C's assignment has the value of its left side
# after it (C99 6.5.16), and gcc and tcc agree. One would guess that a compiler which passes larger programs has this, and that what it
# cannot do it refuses: it compiles without a word. A reader of PLY headers, whose loop ended with it, found no line it knew.
. "$(dirname "$0")/lib.sh"
debian pcc pcc 1.2.0~DEVEL
need gcc gcc
cat >a.c <<'END'
#include <stdio.h>
#include <stddef.h>
typedef struct word { const char *text; size_t length; } word;
static word cut(const char **at, const char *end) {
    word w;
    w.text = *at;
    while (*at < end) ++*at;
    w.length = (size_t)(*at - w.text);
    return w;
}
int main(void) {
    const char *text = "ply", *at = text;
    word k[2];
    int n = 0;
    while (n < 2 && (k[n] = cut(&at, text + 3)).length) n++; /* one word, then an empty one */
    printf("%d words, the last of %d letters\n", n, (int)k[1].length);
    return 0;
}
END
for compiler in pcc gcc; do
    $compiler a.c -o a 2>log || { cat log; exit 2; }
    ./a >"$compiler.said"
    echo "$compiler: $(cat "$compiler.said")"
done
[ "$(cat gcc.said)" = '1 words, the last of 0 letters' ] && [ "$(cat pcc.said)" = '2 words, the last of 0 letters' ]
