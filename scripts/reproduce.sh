#!/bin/sh
# Measures tables of the documents again and prints which figures moved: `scripts/reproduce.sh SCENES [SCRIPT...]`
# SCENES is the folder with the real scenes (docs/use/real-scenes.md). SCRIPT is a name below; all of them by default, which takes hours.
#   TOLERANCE=SHARE  relative difference that counts as equal (0.001)
# Scenes that are absent are skipped with a line. The figures in results/ stay as they are; new ones are in $OUT/reproduce.
# Exit code 1 if a figure moved, 3 if none could be measured.
set -eu
all="backends dram levels organisations paper policies prefetch ray-trees sgrt shadow-orders temporal whole-frame"
[ -d "${1:?the folder with the real scenes}" ] || {
    echo "scripts/reproduce.sh: $1: no such folder; \`make scenes\` makes one" >&2
    exit 2
}
scenes=$(cd "$1" && pwd)
shift
cd "$(dirname "$0")/.."
[ $# -gt 0 ] || set -- $all
for script; do
    case " $all " in
    *" $script "*) ;;
    *)
        echo "scripts/reproduce.sh: expected some of: $all; found '$script'" >&2
        exit 2
        ;;
    esac
done
new=${OUT:-out}/reproduce
mkdir -p "$new"
new=$(cd "$new" && pwd)
rm -f "$new"/*.csv
for script; do
    echo "scripts/$script.sh"
    RESULTS=$new "scripts/$script.sh" "$scenes" || {
        code=$?
        [ $code = 3 ] || exit $code
    }
done
python3 scripts/reproduce.py results "$new" "${TOLERANCE:-0.001}"
