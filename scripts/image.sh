#!/bin/sh
# The two steps of the image, each run by the Dockerfile, and by scripts/build_image.sh where there is no Docker:
#   image.sh build FOLDER     in the sources: puts the wheel, and all that is to be installed with it, into FOLDER
#   image.sh install FOLDER   installs the wheel in FOLDER, with all extras
set -eu

folder=$2
case $1 in
build)
    mkdir -p "$folder"
    python3 -m venv "$folder/tools"
    "$folder/tools/bin/python" -m pip install --quiet --require-hashes --requirement requirements/run.txt
    "$folder/tools/bin/maturin" build --release --locked --strip --compatibility linux --out "$folder"
    rm -rf "$folder/tools"
    # The versions that the tests ran with; hashes would be asked of the wheel too.
    sed -n 's/^\([a-z0-9].*[^ ]\) *\\$/\1/p' requirements/test.txt >"$folder/versions.txt"
    cp "$0" "$folder/image.sh"
    ;;
install)
    wheel=$(ls "$folder"/*.whl)
    python -m pip install --quiet --no-cache-dir --constraint "$folder/versions.txt" "${wheel}[all]"
    ;;
esac
