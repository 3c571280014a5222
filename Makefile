# make run    installs what a run needs into .venv and runs the main job
# make test   installs the tools as well, checks the code, runs all tests, prints their coverage
# make quick  runs the tests but the slow ones
# make mutants  changes core modules and counts what no test notices; resumes, writes docs/mutants.md
# make film   renders docs/walk.gif; make site makes pages of the documents
# make chaos  does every kind of harm to runs, for hours; resumes, writes docs/reliability.md
PYTHON ?= python3.11
SCENARIO ?= config/scenarios/walk_8.88deg_ka12.yaml
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/pip --quiet --disable-pip-version-check
# in the order of tests/conftest.py
PYTEST := ROS_PYTHON_CHECK_FIELDS=1 $(BIN)/python -m pytest -n 2 --dist loadfile \
            --no-loadscope-reorder
PACKAGES := $(wildcard ./src/khr*)
SOURCES := $(shell find src config -type f -not -path '*/build/*' -not -path '*.egg-info/*' \
             -not -path '*/__pycache__/*')

.PHONY: run test quick install tools lint docs site film bench chaos mutants lock version clean

run: install
	$(BIN)/khr run --processes $(SCENARIO)

test: lint
	$(PYTEST) --cov --cov-report=
	$(BIN)/python -m tests.coverage

quick: tools
	$(PYTEST) -m 'not slow'

install: $(VENV)/packages

tools: $(VENV)/tools install

$(VENV)/requirements: requirements.lock
	$(PYTHON) -m venv $(VENV)
	$(PIP) install -r requirements.lock
	touch $@

$(VENV)/tools: requirements-dev.lock $(VENV)/requirements
	$(PIP) install -r requirements-dev.lock
	touch $@

$(VENV)/packages: $(VENV)/requirements $(SOURCES)
	rm -rf src/*/build src/*/*.egg-info
	$(PIP) install --no-deps --no-build-isolation --force-reinstall $(PACKAGES)
	rm -rf src/*/build src/*/*.egg-info
	touch $@

# every kind of fault, some hours; resumes, and writes docs/reliability.md
chaos: tools
	$(BIN)/python -m tests.reliability

# MODULES='khr_sim.servo ...' chooses core modules; a module takes some minutes
mutants: tools
	$(BIN)/python -m tests.mutation $(MODULES) --write docs/mutants.md

lint: tools
	$(BIN)/ruff format --check --quiet src tests examples
	$(BIN)/ruff check src tests examples
	$(BIN)/mypy src/khr*/khr*
	PYTHONPATH=$$(echo src/khr* | tr ' ' :) $(BIN)/lint-imports --no-cache --no-logo

docs: install
	$(BIN)/python -m khr_report.docs_generator
	$(BIN)/python -m khr_analysis.models.report docs/models.md
	$(BIN)/python -m khr_sim.gyro_circuit.report docs/gyro.md

# the documents as pages, in site/; a link that leads nowhere is an error
site: tools
	$(BIN)/sphinx-build --quiet -W --keep-going -c docs . site

# the picture of the README: one slope, without control and with it
FILMED := walk_8.88deg_ka12
film: install
	rm -rf build/without
	$(BIN)/khr run $(FILMED) --offline --set ankle_controller.enabled=false --out build/without
	$(BIN)/khr film build/without --against $(FILMED) --start 0.5 --end 5.5 --rate 10 \
	    --width 480 --height 360 --out build/walk
	cp build/walk.gif docs/walk.gif

bench: tools
	$(BIN)/python -m tests.benchmarks

lock: export CUSTOM_COMPILE_COMMAND = make lock
lock: COMPILE = $(BIN)/pip-compile --quiet --strip-extras --no-emit-index-url \
          --no-emit-find-links --no-emit-trusted-host
lock: tools
	$(COMPILE) --allow-unsafe --all-build-deps --output-file requirements.lock pyproject.toml
	$(COMPILE) --output-file requirements-dev.lock requirements-dev.in

version:
	@test -n '$(VERSION)' || { echo 'make version VERSION=1.2.3'; exit 2; }
	sed -i 's|<version>.*</version>|<version>$(VERSION)</version>|' src/*/package.xml
	sed -i "0,/^version = .*/s//version = '$(VERSION)'/" pyproject.toml
	sed -i '0,/^## \[Unreleased\]/s//&\n\n## [$(VERSION)] - '"$$(date +%F)/" CHANGELOG.md

clean:
	rm -rf $(VENV) site build *.egg-info ros2_ws/build ros2_ws/install ros2_ws/log src/*/build src/*/*.egg-info
