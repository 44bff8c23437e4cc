#!/bin/sh
# Builds the image and tries it. Where Docker does not run, the image's steps are run here: from what the Dockerfile
# would see of the sources, and into an environment of their own.
set -eu

# A node of a cluster of Ray needs these: the agent that answers for its health, and S3.
nodes='import ray.dashboard.optional_deps, s3fs'
root=$(cd "$(dirname "$0")/.." && pwd)
if docker info >/dev/null 2>&1; then
    docker build --tag tumble "$root"
    docker run --rm tumble doctor
    docker run --rm tumble demo
    docker run --rm --entrypoint python tumble -c "$nodes"
    exit
fi
echo "Docker does not run here; trying the steps of the Dockerfile without it"
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir "$work/source"
# shellcheck disable=SC2046 # names of ours, without blanks
(cd "$root" && tar -c --exclude='*.so' --exclude=__pycache__ $(sed -n 's/^!//p' .dockerignore)) | tar -x -C "$work/source"
(cd "$work/source" && CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$root/target}" scripts/image.sh build "$work/image")
python3 -m venv "$work/environment"
export PATH="$work/environment/bin:/usr/local/bin:/usr/bin:/bin"
"$work/image/image.sh" install "$work/image"
cp "$root/scripts/newcomer.py" "$work/newcomer.py"
cd "$work"
python newcomer.py
python -c "$nodes"
