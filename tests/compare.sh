#!/bin/sh
# usage: compare.sh OLD_BENCH NEW_BENCH READINGS [DATASET DEFAULT.ply PUBLISHED.ply]: runs both programs in turn, so many times each, and
# prints for every figure that both have the medians, the range of each over its median, and how many times as much the new one is.
old=$1 new=$2 readings=$3
[ -x "$old" ] && [ -x "$new" ] && [ "$readings" -gt 0 ] || { sed -n '2,3s/^# //p' "$0"; exit 2; }
shift 3
i=0
while [ $i -lt "$readings" ]; do
    for program in "$old" "$new"; do
        said=$("$program" --quick "$@" 2>&1) || { echo "$said" | tail -n 3 >&2; echo '! ! !'; exit 1; }
        # the facts: lines of a key and a number; a table's rows have more
        echo "$said" | awk -v side="$program" 'NF == 2 && $1 ~ /^[a-z0-9_]+$/ && $2 ~ /^[-+0-9.e]+$/ { print side, $1, $2 }'
    done
    i=$((i + 1))
done | sort -k2,2 -k1,1 -k3,3g | awk -v old="$old" -v new="$new" '
    function close_series() {
        if (n) { median[side] = n % 2 ? v[(n + 1) / 2] : (v[n / 2] + v[n / 2 + 1]) / 2; low[side] = v[1]; high[side] = v[n]; seen[side] = key }
        n = 0
    }
    function spread(side) { return median[side] ? 100 * (high[side] - low[side]) / (median[side] < 0 ? -median[side] : median[side]) : 0 }
    function print_key() {
        close_series()
        if (seen[old] == key && seen[new] == key)
            printf "%-46s %10.4g +-%4.1f%% %10.4g +-%4.1f%%  %s\n", key, median[old], spread(old) / 2, median[new], spread(new) / 2,
                   median[old] ? sprintf("%.3f", median[new] / median[old]) : "-"
    }
    $1 == "!" { failed = 1; exit 1 }
    $2 != key { if (key) print_key(); key = $2; side = $1 }
    $1 != side { close_series(); side = $1 }
    { v[++n] = $3 + 0 }
    END { if (key && !failed) print_key() }'
