# make demo: from nothing to a calibration and its figures. make test: install what the tests need
# and pass them. Everything goes into the folder .venv; nothing else on the machine is touched.
#
# Another interpreter: make demo PYTHON=python3.12

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# With its bar on a terminal; a log has no use for a line for every package.
PIP := $(BIN)/python -m pip install $(shell test -t 2 || echo --quiet) --no-compile
# pip would compile one file after the other, and the packages' own tests too. A file that is no Python
# of this version is nobody's business until it is imported.
COMPILE := $(BIN)/python -m compileall -qq -j 0 -x '/tests?/' $(VENV)/lib || true

# What a rebuild of the native core depends on; Python files are live without one.
NATIVE := $(shell find cpp -name '*.cpp' -o -name '*.hpp') CMakeLists.txt pyproject.toml
PACKAGE := $(VENV)/.package
TEST_TOOLS := $(VENV)/.test-tools
DEV_TOOLS := $(VENV)/.dev-tools
CROSS_TOOLS := $(VENV)/.cross-tools
CPP := $(shell find cpp -name '*.cpp' -o -name '*.hpp')

# Every worker imports every test file: with the bytecode of the last run that takes half the time.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo test test-slow test-studies test-fresh test-browser fuzz fuzz-loaders fuzz-dialects doctest lint format cpp-test cpp-test-portable bench studies studies-tracking docs site web wasm wasm-check wheel cross release-check clean

demo: $(PACKAGE)
	$(BIN)/driftwalk demo

# Two workers, each with one half of the tests in their order, which ends with what the slower one has
# left: tests that share a finished run stay together, so that it is made once.
SIDE_BY_SIDE := -n 2 --dist worksteal

test: $(TEST_TOOLS)
	$(BIN)/python -m pytest $(SIDE_BY_SIDE)

test-slow: $(TEST_TOOLS)
	$(BIN)/python -m pytest $(SIDE_BY_SIDE) -m "slow and not study"

# Once a week in CI: tests that are more of a study, each with a faster one among the slow tests. Those in
# Chromium measure times, so they come last, alone.
test-studies: $(TEST_TOOLS)
	$(BIN)/python -m pytest $(SIDE_BY_SIDE) -m "study and not browser"
	$(BIN)/python -m pytest tests/browser -m study

# The property and statistical tests, slow ones too, with new examples and new seeds: some minutes.
# The seed is printed first; the same run again: make test-fresh SEED=123
SEED := $(shell date +%s)

test-fresh: $(TEST_TOOLS)
	DRIFTWALK_TEST_SEED=$(SEED) $(BIN)/python -m pytest $(SIDE_BY_SIDE) -m "false_alarm or hypothesis" \
	  --hypothesis-seed=$(SEED)

# In Chromium, which has to be installed; without it the tests are skipped.
test-browser: $(TEST_TOOLS)
	$(BIN)/python -m pytest tests/browser -m "browser and not study"

# Damaged files against the command line, some 2 a second; the same seed gives the same cases. What
# it finds lies in run/fuzz/findings. The first round makes the valid files, for a minute or two.
FUZZ := run/fuzz
FUZZ_SEED := 1
FUZZ_CASES := 2000

fuzz: $(TEST_TOOLS)
	$(BIN)/python tests/fuzz/fuzz_run.py $(FUZZ) --seed $(FUZZ_SEED) --cases $(FUZZ_CASES)

# Damaged recordings and flow fields against the readers, without the command line: some 60 a second and
# processor. Goes on where it was stopped. A part of the cases: make fuzz-loaders LOADER_FROM=50000
# LOADER_CASES=100000. What it finds lies in run/fuzz-loaders/findings.
LOADER_FUZZ := run/fuzz-loaders
LOADER_FROM := 0
LOADER_CASES := 200000
LOADER_WORKERS := 2

fuzz-loaders: $(TEST_TOOLS)
	$(BIN)/python tests/fuzz/loader_run.py $(LOADER_FUZZ) --seed $(FUZZ_SEED) --from $(LOADER_FROM) \
	  --cases $(LOADER_CASES) --workers $(LOADER_WORKERS)

# All 10,000 dialects of recordings and 3,000 of flow fields, of which `make test-slow` tries a fiftieth a day.
fuzz-dialects: $(TEST_TOOLS)
	DRIFTWALK_ALL_DIALECTS=1 $(BIN)/python -m pytest $(SIDE_BY_SIDE) -m slow \
	  tests/property/test_dialects.py tests/property/test_flow_dialects.py

doctest: $(TEST_TOOLS)
	$(BIN)/python -m pytest $(SIDE_BY_SIDE) --doctest-modules src/driftwalk tests/reference/twin

docs: doctest
	$(BIN)/python -m pytest tests/architecture/test_docs_links.py

# All pages, the reference and a gallery that is drawn now, as a site that works offline: build/site. A
# link that leads nowhere and an example that fails end it. GALLERY=0: the gallery's texts without pictures,
# in half the time; CI draws them once a week.
GALLERY := 1

site: $(DEV_TOOLS)
	$(BIN)/sphinx-build -W --keep-going -q -D plot_gallery=$(GALLERY) -c docs/site -b html . build/site
	$(BIN)/driftwalk play --save build/site/playground.html --overwrite
	@echo "site: build/site/index.html"

lint: $(DEV_TOOLS)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/clang-format --dry-run -Werror $(CPP)

format: $(DEV_TOOLS)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/clang-format -i $(CPP)

# The native core alone, no Python, under the address and undefined-behaviour sanitizers: every instruction
# set (once a week in CI), or without any processor-specific code, which takes half the time.
cpp-test: $(DEV_TOOLS)
	PATH="$(CURDIR)/$(BIN):$$PATH" .ci/cpp-test sanitize

cpp-test-portable: $(DEV_TOOLS)
	PATH="$(CURDIR)/$(BIN):$$PATH" .ci/cpp-test portable

bench: $(PACKAGE)
	$(BIN)/python benchmarks/run_all.py

# How well the likelihood fit recovers what is known: some minutes for the sets of a few recordings,
# an hour for all. Goes on where it was stopped; the set of another engine is left out where ODE is
# missing (77).
STUDIES := run/likelihood
STUDY_SETS := ode synthetic lengths coverage
STUDY_ANGLES := state given

studies: $(PACKAGE)
	for angle in $(STUDY_ANGLES); do for name in $(STUDY_SETS); do \
	  $(BIN)/python studies/likelihood/run.py $(STUDIES) --set $$name --angle $$angle \
	    || test $$? -eq 77 || exit 1; \
	done; done
	$(BIN)/python studies/likelihood/summary.py $(STUDIES) --store studies/likelihood/results

# The page that reports and live views show, from TypeScript into the package. Needs Node 20 or later;
# the bundle is committed, so that only those who change web/ need it.
web:
	cd web && npm ci && npm run check && npm test && npm run build

# How well tracking works on videos of known truth: about an hour, and 10 GB for the longest video
# while it is there. The mouse too, where its folder is named: make studies-tracking MOUSE=FOLDER
TRACKING := run/tracking
TRACKING_SETS := moderate heavy closed-loop

studies-tracking: $(TEST_TOOLS)
	for name in $(TRACKING_SETS); do \
	  $(BIN)/python studies/tracking/run.py $(TRACKING) --set $$name || exit 1; \
	done
	test -z "$(MOUSE)" || $(BIN)/python studies/tracking/run.py $(TRACKING) --set mouse \
	  --video $(MOUSE)/mouse_video.mp4 --published $(MOUSE)/mouse_video_tracked.csv
	$(BIN)/python studies/tracking/summary.py $(TRACKING) --store studies/tracking/results

# The native core of the saved playground as WebAssembly, into the package; committed like the bundle.
wasm: $(CROSS_TOOLS)
	PATH="$(CURDIR)/$(BIN):$$PATH" .ci/wasm write

wasm-check: $(CROSS_TOOLS)
	PATH="$(CURDIR)/$(BIN):$$PATH" .ci/wasm rebuild

wheel: $(DEV_TOOLS)
	$(BIN)/python -m build

# The native core for the other systems of the wheels, by clang as Zig brings it. What was made for
# another processor or for Windows is run where qemu or Wine is installed, and must give the same bits.
cross: $(CROSS_TOOLS)
	PATH="$(CURDIR)/$(BIN):$$PATH" .ci/cross

# Everything that has to hold before a release, with all tests: an hour or more. Only some of it:
# make release-check CHECKS="versions recipe"
CHECKS :=

release-check: $(CROSS_TOOLS)
	PATH="$(CURDIR)/$(BIN):$$PATH" $(BIN)/python .ci/release/check.py $(CHECKS)

clean:
	rm -rf $(VENV) build dist

$(BIN)/python:
	@command -v $(PYTHON) > /dev/null || { \
	  echo "driftwalk needs Python 3.11 or later: '$(PYTHON)' was not found; name one with: make PYTHON=python3.12"; \
	  exit 1; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "driftwalk needs Python 3.11 or later: '$(PYTHON)' is $$($(PYTHON) --version 2>&1); name another with: make PYTHON=python3.12"; \
	  exit 1; }
	@command -v c++ > /dev/null || command -v g++ > /dev/null || command -v clang++ > /dev/null || test -n "$$CXX" || { \
	  echo "driftwalk needs a C++20 compiler and found none: install g++ or clang++, or name one with: make CXX=..."; \
	  exit 1; }
	@echo "Making an environment of Python in $(VENV)."
	$(PYTHON) -m venv $(VENV)

$(PACKAGE): $(BIN)/python $(NATIVE)
	@echo "Installing driftwalk and what it needs into $(VENV), and compiling its core: some minutes, once."
	$(PIP) --editable .
	@echo "Compiling what was installed to bytecode, so that the first command starts at once."
	@$(COMPILE)
	@touch $@

# The package is installed by now, so pip adds its extras alone. Python compiles each of their modules at
# its first import.
$(TEST_TOOLS): $(PACKAGE)
	@echo "Installing what the tests need into $(VENV)."
	$(PIP) "driftwalk[test]"
	@touch $@

$(DEV_TOOLS): $(TEST_TOOLS)
	@echo "Installing the tools of development into $(VENV)."
	$(PIP) "driftwalk[dev]"
	@touch $@

$(CROSS_TOOLS): $(DEV_TOOLS)
	@echo "Installing the tools of other systems into $(VENV)."
	$(PIP) "driftwalk[cross]"
	@touch $@
