# SPDX-License-Identifier: BSD-3-Clause
# A base station: server, workers, maps, status; a program without OpenCV. docs/install.md says how it is built and run.
FROM debian:12-slim
RUN --mount=type=bind,target=/debs \
    apt-get update \
 && apt-get install -y --no-install-recommends /debs/tutti-server_*.deb nats-server \
 && rm -rf /var/lib/apt/lists/* /var/cache/apt/*.bin
RUN useradd --system --create-home --home-dir /var/lib/tutti-server tutti
USER tutti
WORKDIR /var/lib/tutti-server
VOLUME /var/lib/tutti-server
EXPOSE 4222
ENTRYPOINT ["tutti"]
CMD ["--help"]
