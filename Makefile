# make run    set up what is missing, then open the window on the demo photos
# make test   set up what is missing, then every check and every test of the product
# make test-lab   the tests of what makes and judges the weights (tests/lab)
# make lint   the checks alone, without a test
# make setup  the set-up alone
# make portable        a folder that runs without Python, in dist/ (Linux)
# make test-all        every test with every optional package: Ray, SAM 2, TensorBoard, COLMAP, others' measures
# make torture         what it is to survive (PARTS="calls kills", SEED=1; tests/torture/README.md)
# make test-machines   every test, the lab's too, four times, as four other processors and orders would run it
#
# Set-up is a virtual environment in .venv, this package in it, and (Debian, Ubuntu) the system's
# OpenGL libraries where they are missing. Finished steps leave a stamp in .venv and are not
# repeated until pyproject.toml changes.

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DEFAULT_GOAL := help

# Modules are compiled once and kept, whatever the environment says: tests start hundreds of programs.
export PYTHONDONTWRITEBYTECODE :=

BIN := .venv/bin
STAMP := .venv/.langflash
PHOTOS := assets/photos/living_room_left.png assets/photos/living_room_right.png
GL_PACKAGES := libegl1 libegl-mesa0 libgl1 libgl1-mesa-dri libglx-mesa0
WINDOW_PACKAGES := xvfb xdotool
BROWSER_PACKAGES := chromium
TRY_GL := $(BIN)/python -c 'import moderngl; moderngl.create_standalone_context(backend="egl", require=330).release()'

# `install PACKAGE...` with apt, as root or through a sudo that asks for no password.
APT := install() { \
	command -v apt-get >/dev/null || return 1; \
	local as=""; \
	if [ "$$(id -u)" != 0 ]; then sudo -n true 2>/dev/null || return 1; as="sudo -n"; fi; \
	local get="$$as env DEBIAN_FRONTEND=noninteractive apt-get -qq"; \
	local add="$$get install -y --no-install-recommends"; \
	echo "Installing $$*"; \
	$$add "$$@" >/dev/null 2>&1 || { $$get update >/dev/null && $$add "$$@" >/dev/null; }; }

.PHONY: help setup run lint test test-lab test-all test-machines torture portable
help:
	@sed -n '1,9s/^# //p' Makefile

setup: $(STAMP)-dev $(STAMP)-gl $(STAMP)-window $(STAMP)-browser

run: $(STAMP)-package $(STAMP)-gl
	@if $(BIN)/python -c 'import glfw, sys; sys.exit(not glfw.init())' 2>/dev/null; then \
		exec $(BIN)/langflash view $(PHOTOS); \
	fi; \
	echo "No display here: the same job without a window."; \
	mkdir -p out; \
	$(BIN)/langflash reconstruct $(PHOTOS) -o out/living_room.langflash; \
	for what in rgb depth atoms; do \
		$(BIN)/langflash render out/living_room.langflash --size 756x588 --what $$what -o out/$$what.png; \
	done; \
	$(BIN)/langflash query out/living_room.langflash plant floor window --size 756x588 -o out/query; \
	echo "The pictures are in $(CURDIR)/out and $(CURDIR)/out/query."

lint: $(STAMP)-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright & types=$$!; $(BIN)/lint-imports; wait $$types
	@if [ -x $(BIN)/biome ]; then echo $(BIN)/biome ci; $(BIN)/biome ci; \
	else echo "The JavaScript of web pages is not checked: no Biome for this machine."; fi

# No more at a time than cores: three on two were quicker by two minutes, and bounds of time were missed.
# At its end it says what took longest, five seconds and more.
PYTEST := $(BIN)/python -m pytest --numprocesses 2 --dist loadfile --no-loadscope-reorder --durations=50 --durations-min=5
test: setup
	@$(call CHECKED,$(PYTEST) --ignore tests/lab)

test-lab: setup
	$(PYTEST) tests/lab

# The checks take the processor time that tests leave (they wait for windows, disks and each other): that
# is enough for them, and nobody waits for a type checker. What fails in either fails the whole.
CHECKED = nice -n 19 $(MAKE) --no-print-directory lint & checks=$$!; \
	$(1) || failed=$$?; \
	wait $$checks; exit $${failed:-0}

# Where a package is missing its tests fail here, instead of being left out.
test-all: setup $(STAMP)-everything
	@$(call CHECKED,$(PYTEST) --nothing-missing)

# Results must not hang on the processor's vector units (ATEN_CPU_CAPABILITY: what torch uses of them,
# all that is there where it is unset), on the number of threads, or on which test ran before. Three
# passes cover three settings, one and two threads, and two shuffled orders; SEED repeats an order. The
# fourth stands for processors that are not here: every float product is moved by some 1e-7 (tests/moved).
SEED ?= 1
SHUFFLED = --random-order --random-order-seed
test-machines: setup
	env -u ATEN_CPU_CAPABILITY OMP_NUM_THREADS=2 $(PYTEST)
	ATEN_CPU_CAPABILITY=avx2 OMP_NUM_THREADS=1 $(PYTEST) $(SHUFFLED)=$(SEED)
	ATEN_CPU_CAPABILITY=default OMP_NUM_THREADS=2 $(PYTEST) $(SHUFFLED)=$$(($(SEED) + 1))
	env -u ATEN_CPU_CAPABILITY LANGFLASH_MOVED=1 OMP_NUM_THREADS=1 $(PYTEST)

# Hostile files, failing calls, kills, two at once, hard photos, load: two at a time, some 12 minutes on two cores.
PARTS ?=
torture: setup
	PYTHONHASHSEED=0 OMP_NUM_THREADS=1 $(BIN)/python -m tests.torture $(PARTS) --seed $(SEED)

# In an environment of its own, so that nothing else is packed; `make test` does not build it.
PACKING := .venv-portable
portable: | $(BIN)/python
	@test -x $(PACKING)/bin/python || $(BIN)/python -m venv $(PACKING)
	@$(PACKING)/bin/python -m pip install --quiet --disable-pip-version-check torch==2.13.0
	@$(PACKING)/bin/python -m pip install --quiet --disable-pip-version-check 'pyinstaller>=6.10' '.[window]'
	@$(PACKING)/bin/python -m pip uninstall --quiet --yes langflash
	@PYTHONPATH=$(CURDIR) $(PACKING)/bin/python -m PyInstaller --noconfirm --log-level WARN --workpath build/portable --distpath dist .ci/portable/langflash.spec
	@du -sh dist/langflash

# The newest Python from 3.11 that can make a virtual environment.
$(BIN)/python:
	@$(APT); \
	able() { "$$1" -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 15))' >/dev/null 2>&1; }; \
	whole() { "$$1" -c 'import ensurepip, venv' >/dev/null 2>&1; }; \
	names="python3.14 python3.13 python3.12 python3.11 python3 python"; \
	any=""; chosen=""; \
	for name in $$names; do \
		if able $$name; then any=$${any:-$$name}; if whole $$name; then chosen=$$name; break; fi; fi; \
	done; \
	if [ -z "$$any" ]; then \
		echo "LangFlash needs Python 3.11 or newer: install it (for example the packages python3 and python3-venv), then make again." >&2; \
		exit 1; \
	fi; \
	if [ -z "$$chosen" ]; then \
		venv="python$$($$any -c 'import sys; print("%d.%d" % sys.version_info[:2])')-venv"; \
		install $$venv && whole $$any || { \
			echo "This Python cannot make virtual environments: ask for the package $$venv (apt-get install $$venv), then make again." >&2; \
			exit 1; }; \
		chosen=$$any; \
	fi; \
	echo "Making .venv with $$($$chosen --version)"; \
	$$chosen -m venv .venv

# torch first and alone: its pin decides which build of the rest fits.
$(STAMP)-package: pyproject.toml | $(BIN)/python
	@echo "Installing LangFlash and what it needs into .venv (the first time takes minutes)"
	@$(BIN)/python -m pip --version >/dev/null 2>&1 || $(BIN)/python -m ensurepip >/dev/null
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check torch==2.13.0
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[window]'
	@touch $@

$(STAMP)-dev: $(STAMP)-package
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@

$(STAMP)-everything: $(STAMP)-dev
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[everything]'
	@touch $@

# OpenGL without a screen; macOS brings its own.
$(STAMP)-gl: | $(STAMP)-package
	@$(APT); \
	if [ "$$(uname)" = Linux ] && ! $(TRY_GL) >/dev/null 2>&1; then \
		install $(GL_PACKAGES) && $(TRY_GL) >/dev/null 2>&1 || { \
			echo "OpenGL is missing: ask an administrator to run 'apt-get install $(GL_PACKAGES)', then make again." >&2; \
			exit 1; }; \
	fi
	@touch $@

# A screen for the tests of the window; without it those tests are skipped.
$(STAMP)-window: | $(STAMP)-package
	@$(APT); \
	if [ "$$(uname)" = Linux ] && ! { command -v Xvfb && command -v xdotool; } >/dev/null; then \
		install $(WINDOW_PACKAGES) || { \
			echo "The window's tests will be skipped: they need the packages $(WINDOW_PACKAGES)." >&2; \
			exit 0; }; \
	fi; \
	touch $@

# A browser for the tests of web pages; without it those tests are skipped.
$(STAMP)-browser: | $(STAMP)-package
	@$(APT); \
	if [ "$$(uname)" = Linux ] && ! { command -v chromium || command -v chromium-browser || command -v google-chrome; } >/dev/null; then \
		install $(BROWSER_PACKAGES) || { \
			echo "The tests of web pages will be skipped: they need the package $(BROWSER_PACKAGES)." >&2; \
			exit 0; }; \
	fi; \
	touch $@
