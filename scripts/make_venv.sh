#!/bin/sh
# Makes a Python environment: make_venv.sh PYTHON FOLDER
set -eu

wanted=$1
folder=$2

is_recent() {
    command -v "$1" >/dev/null 2>&1 && "$1" -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null
}

python=
for candidate in "$wanted" python3 python3.14 python3.13 python3.12 python3.11 python3.10; do
    if is_recent "$candidate"; then
        python=$candidate
        break
    fi
done
if [ -z "$python" ]; then
    echo "make: no Python 3.10 or later found; install one, or name it: make PYTHON=/path/to/python3" >&2
    exit 1
fi

# Debian and Ubuntu leave ensurepip out of python3.
if ! "$python" -c 'import ensurepip' 2>/dev/null; then
    if [ "$(id -u)" -eq 0 ] && command -v apt-get >/dev/null; then
        apt-get update --quiet --quiet
        apt-get install --yes --quiet --quiet --no-install-recommends python3-venv
    else
        echo "make: $python cannot make environments; install its venv package (apt-get install python3-venv)" >&2
        exit 1
    fi
fi

rm -rf "$folder"
"$python" -m venv "$folder"
