# The front door. Every target builds .venv from requirements.lock when it is missing or stale.
PYTHON ?= python3
BIN := .venv/bin

# Small matrices gain nothing from a threaded BLAS, and stall now and then.
export OPENBLAS_NUM_THREADS := 1
export OMP_NUM_THREADS := 1
# Many processes import the same modules: each is compiled once.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test test-slow latest mutants lint bench measured real docs pictures schemas lock clean

demo: .venv/ready
	@echo 'Running the nominal scenario: both motions simulated, gains identified and judged; some 6 s.'
	$(BIN)/rx90 run nominal --save out/demo
	$(BIN)/rx90 report out/demo
	@echo 'Next: .venv/bin/rx90 shows what else one can do.'

# One worker more than cores: others go on while one waits for a process that it started.
WORKERS := $(shell $(PYTHON) -c 'import os; print((os.cpu_count() or 1) + 1)')
TESTS ?= --numprocesses $(WORKERS) --dist loadfile --no-loadscope-reorder

test: .venv/ready
	$(BIN)/pytest $(TESTS)

test-slow: .venv/ready
	$(BIN)/pytest -m slow

latest:  # the suite against the newest dependencies, without pins, in an environment of its own; says what broke
	$(PYTHON) -m venv --clear out/latest
	out/latest/bin/pip install --quiet --upgrade pip
	out/latest/bin/pip install --quiet --upgrade --editable '.[all]' --group dev
	out/latest/bin/python bench/latest.py $(TESTS)

FILES ?= ident/numerics/*
BY ?= tests/ident/numerics

mutants: .venv/ready  # changes of FILES, one at a time, that the tests BY do not notice
	rm -rf out/mutants && mkdir -p out/mutants && git archive HEAD | tar x -C out/mutants
	printf '%s\n' '[tool.mutmut]' 'source_paths = ["ident", "sim", "scenarios", "rx90_mjcf"]' 'only_mutate = ["$(FILES)"]' \
	  'also_copy = ["docs", "bench", "README.md"]' 'pytest_add_cli_args_test_selection = ["$(BY)"]' >> out/mutants/pyproject.toml
	cd out/mutants && $(CURDIR)/$(BIN)/mutmut run && $(CURDIR)/$(BIN)/mutmut results

lint: .venv/ready
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright

BASE ?= HEAD

bench: .venv/ready  # time and memory by phase beside the commit BASE, into out/bench.html
	$(BIN)/python bench/speed.py $(BASE)

TABLES ?=

measured: .venv/ready  # tables of measured pages in docs/, of `bench/measured.py`; TABLES names some
	$(BIN)/python -m bench.measured $(TABLES)

DOWNLOADS ?= $(REAL_RECORDINGS)

real: .venv/ready  # docs/real-robots.md, from the recordings of bench/recordings/sources.toml in the folder DOWNLOADS
	$(BIN)/python bench/real.py $(DOWNLOADS)

docs: .venv/ready  # the site, into site/; open site/index.html
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --quiet

pictures: .venv/ready  # needs an off-screen OpenGL, MUJOCO_GL=egl or osmesa
	$(BIN)/python docs/hero.py
	$(BIN)/python docs/case.py
	$(BIN)/python docs/architecture.py

schemas: .venv/ready  # of TOML files, into the package
	$(BIN)/python -m scenarios.results.json_schemas

# Names, versions and hashes only: no index address is recorded.
lock: .venv/ready
	$(BIN)/pip install --quiet uv
	$(BIN)/uv pip compile --universal --generate-hashes --no-header --no-emit-index-url --no-annotate \
	  --group dev --all-extras --output-file requirements.lock pyproject.toml

.venv/ready: requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "Python 3.11 or newer is needed; try make PYTHON=python3.11")'
	@echo 'Building .venv, once; with a fast network:'
	@echo '  1 of 3  an empty environment, some 5 s'
	@$(PYTHON) -m venv .venv
	@echo "  2 of 3  $$(grep -c '==' requirements.lock) packages of requirements.lock, some 70 s"
	@began=$$(date +%s); \
	(while sleep 10 >/dev/null 2>&1; do echo "          for $$(($$(date +%s) - began)) s"; done) & alive=$$!; \
	trap "kill $$alive" EXIT INT TERM; \
	$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes -r requirements.lock
	@echo '  3 of 3  this project, some 3 s'
	@$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch .venv/ready

clean:
	rm -rf .venv out dist site
