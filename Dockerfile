# khr without a ROS installation: docker build -t khr . && docker run khr run walk_3deg
FROM python:3.11-slim-bookworm

WORKDIR /khr
COPY requirements.lock ./
RUN pip install --no-cache-dir --require-hashes -r requirements.lock
COPY pyproject.toml setup.py requirements.in README.md LICENSE ./
COPY config config
COPY src src
RUN pip install --no-cache-dir --no-deps --no-build-isolation . && rm -rf build *.egg-info

RUN useradd --create-home khr
USER khr
WORKDIR /home/khr
ENTRYPOINT ["khr"]
CMD ["scenarios"]
