# SPDX-License-Identifier: BSD-3-Clause
# All of Tutti: every command, cameras, the Python module. docs/install.md says how it is built and run.
FROM debian:12-slim
RUN --mount=type=bind,target=/debs \
    apt-get update \
 && apt-get install -y --no-install-recommends /debs/tutti_*.deb /debs/python3-tutti_*.deb nats-server \
 && find /usr/lib/python3* -name __pycache__ -prune -exec rm -r {} + \
 && rm -rf /var/lib/apt/lists/* /var/cache/apt/*.bin
RUN useradd --system --create-home --home-dir /var/lib/tutti tutti
USER tutti
WORKDIR /var/lib/tutti
VOLUME /var/lib/tutti
EXPOSE 4222
ENTRYPOINT ["tutti"]
CMD ["--help"]
