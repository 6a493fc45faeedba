# Build, run and test sdpd. Needs GNU make, a Rust toolchain (rustup: cargo, rustfmt, clippy), a C
# compiler (Rust links with it) and Python >= 3.10 with venv; `make check` says what is missing.
# Python packages go into $(VENV); nothing outside this folder is touched. Stamps inside $(VENV)
# remember what is installed, so a second call costs only what changed.

PYTHON ?= python3
VENV ?= .venv
OUT ?= out
JOBS ?= 2

BIN := $(abspath $(VENV))/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
STAMP := $(VENV)/.sdpd
RUST_SOURCES := Cargo.toml $(wildcard Cargo.lock) $(shell find src -name '*.rs')
NOTEBOOKS := $(wildcard notebooks/*.ipynb)

# pyo3 asks this interpreter about the ABI, so that cargo, clippy and maturin agree
export PYO3_PYTHON := $(BIN)/python
export CARGO_BUILD_JOBS := $(JOBS)
export VIRTUAL_ENV := $(abspath $(VENV))
unexport CONDA_PREFIX
unexport PYTHONHOME

.DEFAULT_GOAL := help
.PHONY: help check build run test lint fmt clippy ruff mypy stubs rust-test pytest notebooks \
        validation bench docs format clean distclean

help:
	@echo 'make run         build, a flow between plates, then the main job: self-diffusion of water'
	@echo 'make test        formatting, lints, types, stubs, Rust and Python tests, notebooks'
	@echo 'make validation  the long physics tests, which rewrite tests/validation/results.json'
	@echo 'make bench       speed of steps, and what each effect costs'
	@echo 'make docs        HTML pages in docs/_build/html'
	@echo 'make build       the package alone, installed editable into $(VENV)'
	@echo 'make format      rewrite Rust and Python sources in the house format'
	@echo 'make clean       remove build products and caches (make distclean: $(VENV) too)'
	@echo
	@echo 'Variables: PYTHON=$(PYTHON) VENV=$(VENV) OUT=$(OUT) JOBS=$(JOBS)'

# ------------------------------------------------------------------------------- installation

check:
	@fail() { echo "sdpd needs $$1" >&2; exit 1; }; \
	command -v cargo >/dev/null || fail 'a Rust toolchain: `cargo` is not on the PATH (see https://rustup.rs)'; \
	command -v cc >/dev/null || command -v gcc >/dev/null || command -v clang >/dev/null || \
	  fail 'a C compiler, by which Rust links: `cc` is not on the PATH (Debian: apt install gcc libc6-dev)'; \
	command -v '$(PYTHON)' >/dev/null || \
	  fail 'Python >= 3.10: `$(PYTHON)` is not on the PATH (name another: make PYTHON=python3.12)'; \
	'$(PYTHON)' -c 'import sys; sys.exit(sys.version_info < (3, 10))' || \
	  fail "Python >= 3.10: \`$(PYTHON)\` is $$('$(PYTHON)' -V 2>&1) (name another: make PYTHON=python3.12)"; \
	'$(PYTHON)' -c 'import ensurepip, venv' 2>/dev/null || \
	  fail 'the venv module of `$(PYTHON)` (Debian: apt install python3-venv)'

$(STAMP)-venv:
	@$(MAKE) --no-print-directory check
	'$(PYTHON)' -m venv '$(VENV)'
	$(PIP) install 'maturin>=1.9,<2'
	@touch $@

# Extras are installed after the package: pip then finds `sdpd` in place and fetches only what they
# add. (maturin itself would look for the self-referring extras in the package index.)
$(STAMP)-build: $(STAMP)-venv $(RUST_SOURCES) pyproject.toml
	PIP_QUIET=1 $(BIN)/maturin develop --release
	@touch $@

$(STAMP)-plot $(STAMP)-dev $(STAMP)-docs: $(STAMP)-%: pyproject.toml | $(STAMP)-build
	$(PIP) install 'sdpd[$*]'
	@touch $@

build: $(STAMP)-build

# -------------------------------------------------------------------------------- the main job

run: $(STAMP)-build $(STAMP)-plot
	$(BIN)/sdpd channel poiseuille --quick -o $(OUT)/channel
	$(BIN)/sdpd diffusion -o $(OUT)/diffusion

# --------------------------------------------------------------------------------------- tests

test: lint rust-test pytest notebooks

lint: fmt clippy ruff mypy stubs

fmt:
	@cargo fmt --version >/dev/null 2>&1 || { echo 'sdpd needs rustfmt: rustup component add rustfmt' >&2; exit 1; }
	cargo fmt --all --check

clippy: | $(STAMP)-venv
	@cargo clippy --version >/dev/null 2>&1 || { echo 'sdpd needs clippy: rustup component add clippy' >&2; exit 1; }
	cargo clippy --all-targets --features python -- -D warnings

ruff: $(STAMP)-dev
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .

mypy: $(STAMP)-build $(STAMP)-dev
	$(BIN)/python -m mypy

stubs: $(STAMP)-build $(STAMP)-dev
	$(BIN)/python -m mypy.stubtest sdpd._core --mypy-config-file pyproject.toml

rust-test:
	cargo test --profile quick

pytest: $(STAMP)-build $(STAMP)-dev
	$(BIN)/python -m pytest -n $(JOBS) --dist worksteal

# Each notebook reads SDPD_NOTEBOOK_SMALL and, where it is set, runs at a size of seconds.
notebooks: $(STAMP)-build $(STAMP)-dev
ifneq ($(NOTEBOOKS),)
	SDPD_NOTEBOOK_SMALL=1 $(BIN)/python -m pytest --nbmake --nbmake-timeout=300 $(NOTEBOOKS)
endif

validation: $(STAMP)-build $(STAMP)-dev
	$(BIN)/python -m pytest -m validation tests

# ---------------------------------------------------------------------------------- the others

bench: $(STAMP)-build $(STAMP)-plot
	$(BIN)/sdpd bench -o $(OUT)/bench
	$(BIN)/sdpd bench effects -o $(OUT)/bench

docs: $(STAMP)-build $(STAMP)-docs
	$(BIN)/python -m sphinx -W --keep-going -q -b html docs docs/_build/html
	@echo 'docs/_build/html/index.html'

format: $(STAMP)-dev
	cargo fmt --all
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

clean:
	rm -rf target dist '$(OUT)' docs/_build docs/_autosummary docs/jupyter_execute \
	  .mypy_cache .pytest_cache .ruff_cache .jupyter_cache python/sdpd/_core*.so $(STAMP)-build
	find python tests docs benches notebooks -name __pycache__ -prune -exec rm -rf {} + 2>/dev/null || true

distclean: clean
	rm -rf '$(VENV)'
