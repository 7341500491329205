# make setup   .venv with all dependencies, the package and its compiled messages   make run    the example rack, with its panel
# make test    style, types and tests; CI runs the same                            make soak   the long tests
# make bench   measurements                     make format   rewrite the style    make clean  remove what was built
# make docs    the site of docs/, into site/
#
# PYTHON=python3.12 chooses the interpreter of .venv (3.10 to 3.13); without it an existing .venv is kept.

SHELL := /bin/bash
BIN := .venv/bin
CONFIG ?= config/dc_drive/rack.yaml
# A file of tests is one worker's, in the order of test/conftest.py; more than four would only hold up live racks.
PARALLEL := --numprocesses auto --maxprocesses 4 --dist loadfile --no-loadscope-reorder

# What runs a second time in plain Python; the whole suite runs with the modules that were compiled ahead of time.
PLAIN := test/drive/current_loop test/drive/base/test_state.py test/drive/plant/test_plant.py test/drive/base/test_motor.py test/runtime \
	test/messages/stream/test_templates.py

# .venv brings its own ROS 2. A sourced distribution or another environment must not mix its libraries in.
ifneq ($(AMENT_PREFIX_PATH)$(_ROS_WHEELS_BOOTSTRAP_COMPLETE),)
unexport LD_LIBRARY_PATH
endif
unexport AMENT_PREFIX_PATH CMAKE_PREFIX_PATH COLCON_PREFIX_PATH RMW_IMPLEMENTATION
unexport PYTHONPATH PYTHONHOME PYTHONSTARTUP VIRTUAL_ENV _ROS_WHEELS_BOOTSTRAP_COMPLETE

.PHONY: setup run test soak bench docs format clean

setup:
	@tools/setup_environment.sh "$(PYTHON)"

# exec: Ctrl-C and the exit code are the program's own.
run: setup
	@exec $(BIN)/automax run $(CONFIG) --panel --operate

# Every step runs, the first failure decides the result, pytest's summary comes last.
test: setup
	@status=0; \
	$(BIN)/ruff check . || status=$$?; \
	$(BIN)/ruff format --check . || status=$$?; \
	$(BIN)/mypy automax_ros tools || status=$$?; \
	AUTOMAX_COMPILED=off $(BIN)/python -m pytest -q $(PLAIN) -m "not soak" $(PARALLEL) || status=$$?; \
	$(BIN)/python -m pytest -q -rs test -m "not soak" $(PARALLEL) || status=$$?; \
	exit $$status

soak: setup
	@exec $(BIN)/python -m pytest -q test -m soak --timeout 3600

bench: setup
	@set -e; for program in bench/[a-z]*.py; do echo "== $$program"; $(BIN)/python "$$program"; done

# The build of the site and its links is a test too: test/docs/.
docs: setup
	@NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet
	@echo "site/index.html"

format: setup
	@$(BIN)/ruff check --fix . || true
	@$(BIN)/ruff format .

clean:
	rm -rf .venv build dist site *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
