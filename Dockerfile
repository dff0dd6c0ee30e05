# An image with drake_tracker and the system packages of its renderer. The steps were tried one by one on Debian 12; the
# image itself was not yet built.
#
#   docker build --tag drake_tracker .
#   docker run --rm --volume "$PWD/runs:/work/runs" drake_tracker run train
FROM python:3.11-slim-bookworm

RUN apt-get update -qq \
    && apt-get install -y -qq --no-install-recommends libglib2.0-0 libegl1 libgl1-mesa-dri \
    && rm -rf /var/lib/apt/lists/*

WORKDIR /source
COPY pyproject.toml constraints.txt README.md LICENSE ./
COPY drake_tracker drake_tracker
COPY models models
RUN python -m pip install --no-cache-dir --root-user-action ignore --constraint constraints.txt . \
    && python -m compileall -q "$(python -c 'import drake_tracker; print(drake_tracker.__path__[0])')"

WORKDIR /work
ENTRYPOINT ["drake-tracker"]
CMD ["--help"]
