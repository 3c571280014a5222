# make run    installs everything into .venv and runs the main job
# make test   installs the same and runs the tests
PYTHON ?= python3.11
SCENARIO ?= config/scenarios/walk_7.68deg_ka12.yaml
VENV := .venv
BIN := $(VENV)/bin
PACKAGES := $(addprefix ./src/khr_,common sim balance analysis bringup experiments figures report cli)
SOURCES := $(shell find src config -type f -not -path '*/build/*' -not -path '*.egg-info/*' \
             -not -path '*/__pycache__/*')

.PHONY: run test install chaos lint docs bench lock clean

run: install
	$(BIN)/khr run --processes $(SCENARIO)

test: install lint
	ROS_PYTHON_CHECK_FIELDS=1 $(BIN)/python -m pytest -n 2 --dist loadfile

install: $(VENV)/packages

$(VENV)/requirements: requirements.lock
	$(PYTHON) -m venv $(VENV)
	$(BIN)/pip install --quiet --disable-pip-version-check -r requirements.lock
	touch $@

$(VENV)/packages: $(VENV)/requirements $(SOURCES)
	rm -rf src/*/build src/*/*.egg-info
	$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation \
	    --force-reinstall $(PACKAGES)
	rm -rf src/*/build src/*/*.egg-info
	touch $@

# every kind of fault, some hours; resumes, and writes docs/reliability.md
chaos: install
	$(BIN)/python -m tests.reliability

lint: install
	$(BIN)/ruff check src tests
	$(BIN)/mypy src/khr_*/khr_*
	PYTHONPATH=$$(echo src/khr_* | tr ' ' :) $(BIN)/lint-imports --no-cache --no-logo

docs: install
	$(BIN)/python -m khr_report.docs_generator

bench: install
	$(BIN)/python -m tests.benchmarks

lock: install
	$(BIN)/pip install --quiet --disable-pip-version-check --dry-run --ignore-installed \
	    --report $(VENV)/lock.json -r requirements.in
	$(BIN)/python -c "import json; print(*sorted('{name}=={version}'.format(**i['metadata']) \
	    for i in json.load(open('$(VENV)/lock.json'))['install']), sep='\n')" > requirements.lock

clean:
	rm -rf $(VENV) ros2_ws/build ros2_ws/install ros2_ws/log src/*/build src/*/*.egg-info
