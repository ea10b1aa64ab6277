# make walk: install if needed, then walk three yoked robots. ARGS='--robots 5' adds options.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
PROBES := runs/probe/3/responses.npz runs/probe/5/responses.npz
TOOLS := $(VENV)/.tools
MANUAL := $(VENV)/.manual
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check
ARGS ?=

.PHONY: install tools walk prepared check test nightly test-containers image-lock sbom lint endurance format docs dist pages manual links gallery figures clip acceptance bench bench-against

install: $(STAMP)

$(STAMP): requirements.lock pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
		{ echo "quadriga needs Python 3.11 or newer: make PYTHON=python3.12 $(MAKECMDGOALS)"; exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(PIP) -c requirements.lock setuptools
	$(PIP) -c requirements.lock --no-build-isolation --editable .
	@touch $@

# What tests and linters need and a walk does not: the extras `export` and `dev`, 0.8 GB.
$(TOOLS): $(STAMP)
	$(PIP) -r requirements.lock
	@touch $@

tools: $(TOOLS)

# What makes the manual: the extra `docs`, 60 MB.
$(MANUAL): $(STAMP)
	$(PIP) -c requirements.lock --no-build-isolation --editable '.[docs]'
	@touch $@

walk: $(STAMP)
	$(BIN)/quadriga walk $(ARGS)

# What several tests need is compiled, collected and fitted once, before they run side by side. Some
# environments forbid Python to keep bytecode; then each of their processes would compile all source.
prepared: $(TOOLS)
	$(BIN)/python -m compileall -q quadriga agents bridges plant shared sim_server tests
	$(BIN)/quadriga prepare --robots 2 --set identification.seconds=60

# What to run at every change: linters, and the tests of what was changed since the last commit.
check: lint
	tests=$$($(BIN)/python -m tests.changed) && { [ -z "$$tests" ] || \
		$(BIN)/python -m pytest -m "not nightly" --numprocesses 2 --dist loadfile $$tests; }

# Three workers on two cores: most tests wait for processes most of their time.
# Files are taken in the order of tests/conftest.py. Whoever tests is not started again after a test
# that hung, which would hang again.
test: prepared
	$(BIN)/python -m pytest -m "not nightly" --numprocesses 3 --dist loadfile \
		--no-loadscope-reorder --max-worker-restart 0 $(ARGS)

# One by one what keeps real time, needs a browser, networks of its own or the package index, types
# what pages show, or takes long.
nightly: prepared
	$(BIN)/python -m pytest -m nightly $(ARGS)

lint: $(TOOLS)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# A team in real containers, of Docker or Podman, one of which is killed; some five minutes, and
# as many more for the first image. BASE, GL and BUILD_OPTIONS: docs/containers.md.
test-containers: $(TOOLS)
	$(BIN)/python -m tests.containers $(ARGS)

# deploy/image.lock: what an image is made of, in the versions of requirements.lock, with hashes.
image-lock: $(TOOLS)
	echo 'setuptools>=77' | $(BIN)/uv pip compile --quiet pyproject.toml - -c requirements.lock \
		--generate-hashes --no-annotate --custom-compile-command 'make image-lock' \
		--python-version 3.11 --python-platform linux --only-binary :all: -o deploy/image.lock

# What an image is made of, as a software bill of materials (CycloneDX), in dist/.
sbom: $(TOOLS)
	mkdir -p dist
	$(BIN)/python -W ignore -m cyclonedx_py requirements deploy/image.lock --pyproject pyproject.toml \
		--output-reproducible -o dist/quadriga.cdx.json

# Half an hour of two robots in real time: does memory grow, is anything lost?
endurance: $(STAMP)
	$(BIN)/python -m benchmarks.endurance $(ARGS)

format: $(TOOLS)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# The manual as HTML in docs/_build: first the pages that are generated, then all of them. A warning,
# such as that of a link that leads nowhere, is an error.
docs: pages
	$(MAKE) manual

pages: $(STAMP)
	$(BIN)/quadriga config --markdown > docs/configuration.md
	$(BIN)/python -m quadriga.shared.schema > docs/messages.md
	$(BIN)/python -m quadriga.faults.page > docs/faults.md
	$(BIN)/python -m quadriga.stop_times.page
	$(BIN)/python -m quadriga.commands.markdown > docs/reference/command_line.md
	$(BIN)/python -m quadriga.experiments.gallery --page > docs/gallery.md

# Wheel and source distribution, in dist/.
dist: $(TOOLS)
	$(BIN)/python -m tests.deploy.dist

manual: $(MANUAL)
	$(BIN)/python -m sphinx --builder html --quiet --fail-on-warning docs docs/_build
	@echo "the manual: docs/_build/index.html"

# Whether the links of the manual to elsewhere lead anywhere; it needs the internet.
links: $(MANUAL)
	$(BIN)/python -m sphinx -q -b linkcheck docs docs/_build/links

# A clip of each scenario, from real walks; about twenty minutes, and more for each team that has not
# walked here before. ARGS=NAME … draws some of them.
gallery: $(STAMP)
	$(BIN)/python -m quadriga.experiments.gallery $(ARGS)

# Every figure and table of results in the docs, and the clip; two cores walk 30 times a minute. It
# goes on where it ended. With ARGS the clip is left alone: ARGS=--only-publish walks nothing,
# ARGS='hard --seeds 0:2' only looks.
figures: $(STAMP) $(if $(ARGS),,$(PROBES))
	$(BIN)/quadriga experiments $(ARGS)
	$(if $(ARGS),,$(MAKE) clip)

# The true responses that the experiment `distribution` plans with, for comparison.
runs/probe/%/responses.npz: | $(STAMP)
	$(BIN)/quadriga probe --robots $* --repetitions 8 --out runs/probe/$*

# The clip of the README.
clip: $(STAMP)
	folder=$$(mktemp -d) && trap 'rm -rf $$folder' EXIT && $(BIN)/quadriga walk --seconds 10 \
		--scenario hard-blocks --seed 601 --set planner.preset=fast --out $$folder/run && \
		cp $$folder/run/walk.webp docs/figures/

# Every scenario the project promises, over the bus, on three seeds: fails if a robot falls or a limit
# is missed. About an hour; it goes on where it ended.
acceptance: $(STAMP)
	$(BIN)/quadriga experiments deploy/acceptance.toml --seeds 0:3 --bus --require \
		--out runs/acceptance $(ARGS)
	for seed in 0 1 2; do \
		$(BIN)/quadriga walk --robots 1 --mode realtime --seconds 10 --seed $$seed --no-render \
			|| exit 1; \
	done

# What everything costs, on one page and in runs/bench.json; some five minutes, and as many
# more for each team that has not walked here before (ten robots: much more).
bench: $(STAMP)
	$(BIN)/python -m benchmarks $(ARGS)

# Whether this checkout is faster than an earlier commit, both in turns; half an hour. For example
# make bench-against ARGS=HEAD~10
bench-against: $(STAMP)
	$(BIN)/python -m benchmarks.against $(ARGS)
