# One short target per chore; each sets up what it needs in .venv.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
PEERS := $(VENV)/.peers
BROWSER := $(VENV)/.browser
DOCS := $(VENV)/.docs

# Half of all lines of installed Python, which nothing here imports: others' tests, tools, and what C modules stand for.
UNUSED := /(tests?|pip|mypyc?|debugpy|OpenGL|setuptools|pkg_resources|IPython|jedi|prompt_toolkit|docutils|cma)/

# The tests start hundreds of processes, each of which would compile every module that it imports.
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help demo demo-tasks kernels test test-browser test-long check bench bench-suite bench-start bench-release bench-anytime bench-more study-algorithms notebooks docs reproduce clean

help:  ## list the targets
	@grep -E '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*## /\t/'

$(READY): pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "trajevo needs Python 3.11 or newer; $(PYTHON) is $$($(PYTHON) --version). Use: make PYTHON=python3.12 ..."; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-compile -c constraints.txt -e '.[dev]'
	@# What pip would do on one core only; like pip, without a word on files that are no modules of this Python.
	@$(BIN)/python -m compileall -qq -j 0 -x '$(UNUSED)' $(VENV)/lib || true
	@touch $@

# What the table compares with where it can be installed; where it cannot, the table says so.
$(PEERS): $(READY)
	-$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[bench]'
	-$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt drake
	@touch $@

# Pages are tried in Debian's Chromium; where it cannot be installed, the tests say so and are skipped.
$(BROWSER): $(READY)
	-$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[browser]'
	@command -v chromium >/dev/null || command -v chromium-browser >/dev/null || { [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null && \
		{ apt-get install -y -qq --no-install-recommends chromium >/dev/null || \
		{ apt-get update -qq && apt-get install -y -qq --no-install-recommends chromium >/dev/null; }; }; } || \
		echo "test-browser: Chromium is not there and cannot be installed by this user: apt-get install chromium"
	@touch $@

$(DOCS): $(READY)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -e '.[docs]'
	@touch $@

demo: $(READY)  ## solve the pointing mechanism of Sun 2020: front, plots and report in runs/pointing
	$(BIN)/trajevo solve pointing --seed 1 --generations 200 --population 150 --out runs/pointing --overwrite --pictures
	$(BIN)/trajevo show runs/pointing

PAPERS := sun2020 guo2016 paing2021 raji2022
MADE := $(PAPERS:%=build/reproduced/%/page.md)

# Each paper anew where something of ours has changed since; two beside each other on two cores: make -j 2 reproduce.
reproduce: $(MADE)  ## make the figures and tables of the four papers again, in build/reproduced/

build/reproduced/%/page.md: $(READY) $(shell find trajevo problems robots -name '*.py' -o -name '*.toml' -o -name '*.urdf') | kernels
	$(BIN)/trajevo reproduce $* --out build/reproduced/$* || { rm -f $@; exit 1; }

TASKS := ur5_pick_and_place ur5_base ur5_tilt ur5_order ur5_postures panda_six_points xarm7_obstacle hybrid_manipulator pick_and_place_cell

demo-tasks: $(READY)  ## solve and verify the worked tasks, in runs/
	set -e; for task in $(TASKS); do \
		$(BIN)/trajevo solve $$task --overwrite; \
		$(BIN)/trajevo verify runs/$$task --solution knee; \
	done

kernels: $(READY)  ## compile all loops for this machine, 10 s once
	$(BIN)/python -m trajevo.base.kernels

test: kernels  ## run the tests
	@# Threads of BLAS wait for one another by turning round, which costs a tenth where every core has a test already.
	OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest -q -n 2 --dist worksteal -m 'not long and not browser'

test-browser: $(BROWSER) kernels  ## try the pages in headless Chromium
	$(BIN)/python -m pytest -q -m browser tests/browser

test-long: kernels  ## run the tests that take minutes
	$(BIN)/python -m pytest -q -m long

fuzz: kernels  ## read 20,000 mutated files of all kinds that strangers may send, 10 minutes; SECURITY.md
	$(BIN)/python tests/fuzz/run.py $(FUZZ)

check: $(READY)  ## lint, spelling, types and the layer contract
	$(BIN)/codespell
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(PEERS) kernels  ## print one table of speed: ratios to what others take, in one run; docs/speed.md
	$(BIN)/python tests/benchmarks/table.py

bench-suite: $(PEERS) kernels  ## rivals on published problems in runs/bench, 20 minutes; a night with SIZE=full: docs/how_to/benchmark.md
	$(BIN)/trajevo bench run --size $(or $(SIZE),small) --workers 2 --out runs/bench
	$(BIN)/trajevo bench table runs/bench --out runs/bench
	$(BIN)/trajevo bench compare published runs/bench

bench-more: kernels  ## print what else is measured: certificates, polish, starts, studies, payload diagrams, workspaces
	set -e; for file in tests/benchmarks/bench_*.py; do echo "== $$file"; $(BIN)/python $$file; done

bench-start: $(READY)  ## print what a first run takes by its parts, with empty caches and with full ones; docs/speed.md
	$(BIN)/python tests/benchmarks/bench_start.py

bench-release: kernels  ## print speed against another version in one run, AGAINST=v0.1.0 or any commit: docs/speed.md
	$(BIN)/python tests/benchmarks/releases.py $(or $(AGAINST),$(error AGAINST: expected a tag or commit of this project, or what pip installs: make bench-release AGAINST=v0.1.0))

bench-anytime: kernels  ## print times to the best known front against another version in one run, AGAINST=any commit: docs/how_to/benchmark.md
	$(BIN)/python tests/benchmarks/anytime.py $(or $(AGAINST),$(error AGAINST: expected a tag or commit of this project: make bench-anytime AGAINST=271f7b7))

study-algorithms: kernels  ## which algorithm, with or without polish and good starts: 4,800 runs, an hour; docs/explanation/algorithms.md
	$(BIN)/python tests/benchmarks/study_algorithms.py

notebooks: $(READY)  ## execute every notebook at full size, into build/notebooks
	TRAJEVO_FULL=1 $(BIN)/python tests/execute_notebooks.py

PAPERS := sun2020 guo2016 paing2021 raji2022

TUTORIALS := $(patsubst notebooks/%.ipynb,build/docs/tutorials/%.ipynb,$(wildcard notebooks/[0-9]*.ipynb))

# At their short size, again only after they changed.
build/docs/tutorials/%.ipynb: notebooks/%.ipynb $(READY) | kernels
	$(BIN)/python tests/execute_notebooks.py notebooks/$*.py $@

docs: $(DOCS) kernels $(MADE) $(TUTORIALS)  ## build the site, in build/docs/html; warnings are errors, and nothing is loaded from the network
	$(BIN)/python -m sphinx --quiet --fail-on-warning --keep-going -d build/docs/doctrees docs build/docs/html
	@echo "written: build/docs/html/index.html"

clean:  ## remove the environment and everything generated
	rm -rf $(VENV) build dist runs .mypy_cache .ruff_cache .pytest_cache .import_linter_cache
