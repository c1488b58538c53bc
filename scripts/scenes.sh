#!/bin/sh
# Fetches and converts the real scenes of the results (docs/use/real-scenes.md): `scripts/scenes.sh FOLDER [SCENE...]`
# Downloads stay in FOLDER/downloads. Images need Pillow: the system's, or one in a virtual environment in FOLDER.
set -eu
folder=${1:?the folder to make scenes in}
mkdir -p "$folder"
folder=$(cd "$folder" && pwd)
shift
cd "$(dirname "$0")/.."
python=python3
command -v python3 >/dev/null || {
    echo "scripts/scenes.sh: python3 is absent" >&2
    exit 2
}
if ! python3 -c 'import PIL' 2>/dev/null; then
    venv=$folder/downloads/venv
    [ -x "$venv/bin/python" ] || python3 -m venv "$venv" >/dev/null 2>&1 || true
    # Without it, only the teapot can be made, and the other scenes are skipped with a line.
    if "$venv/bin/python" -m pip --disable-pip-version-check install --quiet 'pillow>=9.4' >/dev/null 2>&1; then
        python=$venv/bin/python
    fi
fi
"$python" -B scripts/scenes/make.py "$folder" "$@"
