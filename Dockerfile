# The emulated hand, the hardware suite and the command line, for CI without hardware:
#   docker build -t aero-hil . && docker run --rm -v "$PWD:/results" aero-hil validate
# A physical hand: add `--device /dev/ttyACM0 --group-add dialout` and `--hil /dev/ttyACM0`.
# `docker run --rm --entrypoint pytest aero-hil /project/tests/hil` runs the suite.
FROM python:3.12-slim
COPY . /project
RUN pip install --no-cache-dir "/project[suite]" && useradd --create-home tester && mkdir /results && chown tester /results
USER tester
WORKDIR /results
ENTRYPOINT ["aero-hil"]
