# make run    installs what a run needs into .venv and runs the main job
# make test   installs the tools as well, checks the code, runs the tests
# make quick  runs the unit tests and golden hashes, without the slow ones, in some minutes
# make nightly  runs all tests, also those of whole studies and the longest of the others
# make coverage  runs all tests, measured, and prints their coverage by module
# make mutants  mutates core modules and prints the mutants that survive their unit tests; resumes
# make bullet  compiles PyBullet where it has no wheel (Python 3.12); MuJoCo is the engine without it
# make dist   builds sdist and wheel of the whole in dist/
# make film   renders docs/walk.gif, recovery.gif, bout.gif and duel.gif; make site makes pages of the documents
# make chaos  does every kind of harm to runs, for hours; resumes, writes docs/reliability.md

# bytecode is kept, whatever this machine prefers: without it every process compiles its sources
unexport PYTHONDONTWRITEBYTECODE
PYTHON ?= $(firstword $(shell command -v python3.11) $(shell command -v python3.12) python3.11)
SCENARIO ?= config/scenarios/walk_8.88deg_ka12.yaml
VENV := .venv
BIN := $(VENV)/bin
# a module in the arithmetic that khr itself computes in
PORTABLE := $(BIN)/python -m khr_common.arithmetic -m
INSTALL := $(BIN)/python .ci/install
# in the order of tests/conftest.py; three at a time on two cores, as tests of runs wait much
PYTEST := ROS_PYTHON_CHECK_FIELDS=1 $(BIN)/python -m pytest -n 3 --dist loadfile \
            --no-loadscope-reorder
IN_PARALLEL := $(MAKE) --no-print-directory --jobs 2 --output-sync
PACKAGES := $(wildcard ./src/khr*)
SOURCES := $(shell find src config -type f -not -path '*/build/*' -not -path '*.egg-info/*' \
             -not -path '*/__pycache__/*')

.PHONY: run test quick bullet dist nightly coverage install tools lint types style kernel docs site film bench chaos mutants lock version clean

run: install
	$(BIN)/khr run --processes $(SCENARIO)

test: tools
	$(IN_PARALLEL) types style kernel
	$(PYTEST) -m 'not nightly'

nightly: tools
	$(IN_PARALLEL) types style kernel
	$(PYTEST) --hypothesis-profile nightly

quick: tools
	$(PYTEST) tests/unit tests/golden -m 'not slow and not nightly' --hypothesis-profile quick

# apart from the tests: what is measured takes twice the computing
coverage: tools
	$(PYTEST) --cov --cov-report=
	$(BIN)/coverage report --skip-covered --sort cover

install: $(VENV)/packages

tools: $(VENV)/tools install

# the wheels of ROS 2 Jazzy are for these two; those of PyBullet for 3.11 alone
SUPPORTED := (3, 11) <= sys.version_info[:2] <= (3, 12)
$(VENV)/requirements: requirements.lock
	@$(PYTHON) -c "import sys; sys.exit(not $(SUPPORTED))" || { echo "$(PYTHON): is missing, or \
	not accepted: rclpy has no wheel for it; accepted: make PYTHON=/path/to/python3.11 (or 3.12)"; exit 2; }
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) --require-hashes -r requirements.lock
	touch $@

$(VENV)/tools: requirements-dev.lock $(VENV)/requirements
	$(INSTALL) --require-hashes -r requirements-dev.lock
	touch $@

$(VENV)/packages: $(VENV)/requirements $(SOURCES)
	rm -rf src/*/build src/*/*.egg-info
	$(INSTALL) --no-deps --no-build-isolation --force-reinstall $(PACKAGES)
	rm -rf src/*/build src/*/*.egg-info
	touch $@

# PyBullet has no wheel for Python 3.12: compile it, with progress and on all cores (some minutes)
bullet: install
	$(BIN)/python .ci/bullet

# every kind of fault, some hours; resumes, and writes docs/reliability.md; JOBS=2 for two at a time
JOBS := 1
chaos: tools
	$(PORTABLE) tests.reliability --jobs $(JOBS)

# a module takes from some minutes to an hour
MODULES := khr_sim.servo khr_sim.sensors khr_balance.controllers khr_models.standing.push
mutants: tools
	.ci/mutants $(MODULES)

# types take longest, and the rest runs beside them
lint: tools
	$(IN_PARALLEL) types style

types: tools
	$(BIN)/mypy src/khr*/khr*

style: tools
	$(BIN)/ruff format --check --quiet src tests examples
	$(BIN)/ruff check src tests examples
	PYTHONPATH=$$(echo src/khr* | tr ' ' :) $(BIN)/lint-imports --no-cache --no-logo

# Numba compiles the control period of MuJoCo once, before many tests at a time find it missing
kernel: install
	rm -rf $(VENV)/kernel
	$(BIN)/khr run stand_0deg --engine mujoco --offline --duration 0.03 --out $(VENV)/kernel > /dev/null

docs: install
	$(PORTABLE) khr_studies.documents.docs_generator
	$(PORTABLE) khr_models.report docs/models.md
	$(PORTABLE) khr_models.gyro_circuit.report docs/gyro.md

# the documents as pages, in site/; a link that leads nowhere is an error
site: tools
	$(BIN)/sphinx-build --quiet -W --keep-going -c docs . site

# the films of README, docs/recovery.md, docs/bouts.md and docs/fights.md
FILMED := walk_8.88deg_ka12
film: install
	rm -rf build/without
	$(BIN)/khr run $(FILMED) --offline --set ankle_controller.enabled=false --out build/without
	$(BIN)/khr film build/without --against $(FILMED) --start 0.5 --end 5.5 --rate 10 \
	    --width 480 --height 360 --out build/walk
	cp build/walk.gif docs/walk.gif
	rm -rf build/planted
	$(BIN)/khr run push_behind_step --offline --set recovery.enabled=false --out build/planted
	$(BIN)/khr film build/planted --against push_behind_step --start 2.8 --end 5.0 --rate 20 \
	    --width 480 --height 360 --out build/recovery
	cp build/recovery.gif docs/recovery.gif
	$(BIN)/khr film shove --start 1.5 --end 4.3 --rate 10 --width 480 --height 360 --out build/bout
	cp build/bout.gif docs/bout.gif
	rm -rf build/duel
	$(BIN)/khr bout duel --offline --no-record --set red.ankle_controller.enabled=false --out build/duel
	$(BIN)/khr film build/duel --start 1.5 --end 5.3 --rate 10 --width 480 --height 360 --out build/duel
	cp build/duel.gif docs/duel.gif

# one distribution of all packages
dist: tools
	rm -rf dist
	$(BIN)/python .ci/dist dist

bench: tools
	$(PORTABLE) tests.benchmarks

# with the digests of every file of every version, for any machine
lock: COMPILE = $(BIN)/uv pip compile --quiet --generate-hashes --no-emit-index-url \
          --python-version 3.11 --custom-compile-command 'make lock' --output-file
lock: tools
	printf 'setuptools<80\nwheel\n' | $(COMPILE) requirements.lock requirements.in -
	sed -i "s/^\(pybullet==[^ ]*\) \\\\/\1 ; python_version < '3.12' \\\\/" requirements.lock
	$(COMPILE) requirements-dev.lock requirements-dev.in

version:
	@test -n '$(VERSION)' || { echo 'make version VERSION=1.2.3'; exit 2; }
	sed -i 's|<version>.*</version>|<version>$(VERSION)</version>|' src/*/package.xml
	sed -i "0,/^version = .*/s//version = '$(VERSION)'/" pyproject.toml
	sed -i '0,/^## \[Unreleased\]/s//&\n\n## [$(VERSION)] - '"$$(date +%F)/" CHANGELOG.md
	sed -i 's/^version: .*/version: $(VERSION)/; s/^date-released: .*/date-released: '"'$$(date +%F)'/" CITATION.cff

clean:
	rm -rf $(VENV) site build dist *.egg-info ros2_ws/build ros2_ws/install ros2_ws/log src/*/build src/*/*.egg-info
