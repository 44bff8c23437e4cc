# docker build --tag tumble .
# docker run --rm --volume "$PWD:/work" --user "$(id -u)" tumble inspect log.csv
FROM rust:1.98.0-slim-bookworm@sha256:1469a27c125cb5a3aebfa4f4e4665d935b02fb72cc093b2c974b3d740e43f157 AS build
RUN apt-get update \
    && apt-get install --yes --no-install-recommends python3-venv \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /source
COPY . .
RUN scripts/image.sh build /image

FROM python:3.13.14-slim-bookworm@sha256:67a1e1f215ccda113cfc024e8639049257e88f273898f595b61476d128d387e8
# Older operators of KubeRay ask by wget whether a node is well.
RUN apt-get update \
    && apt-get install --yes --no-install-recommends wget \
    && rm -rf /var/lib/apt/lists/*
RUN --mount=type=bind,from=build,source=/image,target=/image /image/image.sh install /image
RUN useradd --create-home tumble && install --directory --owner tumble /work
USER tumble
WORKDIR /work
ENTRYPOINT ["tumble"]
CMD ["--help"]
