# docker build --tag tumble .
# docker run --rm --volume "$PWD:/work" --user "$(id -u)" tumble inspect log.csv
FROM rust:1-slim-bookworm AS build
RUN apt-get update \
    && apt-get install --yes --no-install-recommends python3-venv \
    && rm -rf /var/lib/apt/lists/*
WORKDIR /source
COPY . .
RUN scripts/image.sh build /image

FROM python:3.13-slim-bookworm
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
