#!/bin/sh
# Installs the Python package into a fresh virtual environment, tests it, and executes its notebooks.
#   OUT=FOLDER            executed notebooks and their figures go to FOLDER/notebooks (default out)
#   PARALLAX_WHEEL=FILE   the wheel (`make dist`); without it, pip builds the extension module
#   UPDATE_NOTEBOOKS=1    rewrites the notebooks and the figures of docs/use/python.md
# Exit code 3, with a line `SKIPPED: ...`, where venv or the package index is absent.
set -eu
cd "$(dirname "$0")/.."
out=${OUT:-out}/notebooks
mkdir -p "$out"
out=$(cd "$out" && pwd)
venv=$out/venv
rm -rf "$venv"

absent() {
    echo "SKIPPED: $1"
    exit 3
}
command -v python3 >/dev/null || absent "python3 is absent"
python3 -m venv "$venv" >"$out/venv.log" 2>&1 || absent "python3-venv is absent"
python=$venv/bin/python
pip() {
    "$python" -m pip --disable-pip-version-check "$@"
}
pip download --quiet --no-deps --dest "$out" iniconfig >"$out/pip.log" 2>&1 ||
    absent "the Python package index cannot be reached"

# Byte code of packages that run once is not worth its time.
pip install --quiet --no-compile "${PARALLAX_WHEEL:-./python}[notebooks]"
# Not from python/, whose folder `parallax` has no extension module.
"$python" -m pytest -q -p no:cacheprovider python/tests
if [ "${UPDATE_NOTEBOOKS:-}" = 1 ]; then
    "$python" python/notebooks/execute.py --update
else
    "$python" python/notebooks/execute.py "$out"
fi
