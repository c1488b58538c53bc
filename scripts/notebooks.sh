#!/bin/sh
# Installs the wheel into a fresh virtual environment, executes the package's notebooks, and runs its tests.
#   PARALLAX_WHEEL=FILE   the wheel (`make wheel`)
#   OUT=FOLDER            executed notebooks and their figures go to FOLDER/notebooks (default out)
#   UPDATE_NOTEBOOKS=1    rewrites the notebooks and the figures of docs/use/python.md
# Exit code 3, with a line `SKIPPED: ...`, where venv or the package index is absent.
set -eu
wheel=$(realpath "${PARALLAX_WHEEL:?expected the wheel that \`make wheel\` writes}")
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
pip install --quiet --no-compile "$wheel[notebooks,tests]"
# Not from python/, whose folder `parallax_traces` has no extension module.
"$python" -m pytest -q -p no:cacheprovider python/tests >"$out/tests.log" 2>&1 &
code=0
if [ "${UPDATE_NOTEBOOKS:-}" = 1 ]; then
    "$python" python/notebooks/execute.py --update || code=1
else
    # The copies have the package, and neither its sources nor the programs that were built.
    rm -rf "$out/copy"
    cp -r python/notebooks "$out/copy"
    (cd "$out/copy" && "$python" execute.py "$out") || code=1
fi
wait $! || code=1
cat "$out/tests.log"
exit $code
