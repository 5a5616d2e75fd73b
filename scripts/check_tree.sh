#!/bin/sh
# Looks for what no compiler sees: paths of somebody's machine, trailing blanks, scripts with mistakes.
set -eu
cd "$(dirname "$0")/.."
git rev-parse --is-inside-work-tree >/dev/null 2>&1 || exit 0
status=0

# Prints lines of text files in the tree that match $2 (an extended regular expression) under the title $1.
forbid() {
    if git grep -nIE "$2"; then
        echo "check_tree: $1" >&2
        status=1
    fi
}

forbid 'a path of one machine' '(^|[^[:alnum:]_.$~})])/([h]ome|[r]oot|[U]sers|[w]ork)/'
forbid 'blanks at the end of a line' '[[:blank:]]+$'
if command -v shellcheck >/dev/null 2>&1; then
    shellcheck scripts/*.sh .ci/run || status=1
fi
exit $status
