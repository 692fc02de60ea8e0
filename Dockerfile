# The demo, in a machine of its own:
#
#     docker build -t driftwalk .
#     docker run --rm -v "$PWD/demo:/work/demo" driftwalk
#
# Any other command: docker run --rm -v "$PWD:/work" driftwalk fit recording.csv -o fit
FROM python:3.13-slim AS build
# The compiler of the image's own release; a version of it would be gone in some months.
# hadolint ignore=DL3008
RUN apt-get update \
 && apt-get install -y --no-install-recommends g++ \
 && rm -rf /var/lib/apt/lists/*
COPY . /src
RUN python -m pip wheel --no-cache-dir --no-deps --wheel-dir /wheels /src

FROM python:3.13-slim
COPY --from=build /wheels /wheels
RUN set -- /wheels/driftwalk-*.whl \
 && python -m pip install --no-cache-dir "driftwalk[track,ros] @ file://$1" \
 && rm -rf /wheels
# Matplotlib keeps its list of fonts there, whoever runs this.
ENV MPLCONFIGDIR=/tmp/matplotlib
WORKDIR /work
ENTRYPOINT ["driftwalk"]
CMD ["demo", "--quick", "--out", "demo"]
