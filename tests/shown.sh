#!/bin/sh
# usage: shown.sh: an example calls each function of ssdgs.h's interface, and sets or reads each member of its structs.
# By name alone: a member counts as shown where another struct's of that name is.
passed=0 failed=0
bare() { awk '{ # the files without comments, in one line
    for (line = $0; ; line = substr(line, at + 2)) {
        if (!(at = index(line, within ? "*/" : "/*"))) { if (!within) printf "%s ", line; break }
        if (!within) printf "%s ", substr(line, 1, at - 1)
        within = !within } }' "$@"; }
names() { bare | awk '{ # FUNCTION, or STRUCT MEMBER; nested structs count as members of the outer one
    while (match($0, /SSDGS_API [^;(]*\(/)) {
        n = split(substr($0, RSTART, RLENGTH - 1), word, /[ *]+/); print word[n]; $0 = substr($0, 1, RSTART) substr($0, RSTART + 10) }
    while (match($0, /typedef struct ssdgs_[a-z_]+ \{/)) {
        split(substr($0, RSTART, RLENGTH), word, " "); $0 = substr($0, RSTART + RLENGTH)
        body = substr($0, 1, match($0, /\} *ssdgs_[a-z_]+;/) - 1); gsub(/\[[^]]*\]/, "", body); count = split(body, member, /[;{}]/)
        for (i = 1; i <= count; i++) {
            if (match(member[i], /\(\*[a-z_]+\)/)) { print word[3], substr(member[i], RSTART + 2, RLENGTH - 3); continue }
            n = split(member[i], part, ",")
            for (k = 1; k <= n; k++) if (match(part[k], /[a-z_]+ *$/)) { name = substr(part[k], RSTART); sub(/ +$/, "", name)
                if (name != "struct") print word[3], name } } } }'; }
# Left out: version, which the _default() functions alone write; move of settings.placement, which is for ssdgs_object_default() to apply.
named=$(sed '1,/^#ifndef SSDGS_H/d; /^#endif .* SSDGS_H /q; /^#/d' ssdgs.h | names | grep -Evx 'ssdgs_[a-z_]+ version|ssdgs_settings move')
for use in $(bare examples/*.c examples/*.h examples/gpu/*.c | grep -Eo 'ssdgs_[a-z_0-9]+ *\(|(\.|->)[a-z_]+|(SETTING|OPTION|offsetof)\([^()]*\)' |
    sed -E 's/ *\($/()/; s/->/./; s/.*[ ,]([a-z_]+)\)$/.\1/' | sort -u); do uses="$uses $use"; done
while read -r struct member; do
    case "$uses " in *" ${member:+.}${member:-$struct()} "*) passed=$((passed + 1)) ;;
    *) failed=$((failed + 1)); echo "failed: no example has $struct${member:+.$member}" ;; esac
done <<END
$named
END
[ $passed -gt 200 ] || { failed=$((failed + 1)); echo "failed: only $passed names found in ssdgs.h"; }
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
