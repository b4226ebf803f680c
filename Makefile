# Commands of ACCESS-AV; `make help` lists them.
PYTHON ?= python3
SHELL := bash
.SHELLFLAGS := -o pipefail -c
BIN := .venv/bin
SOURCES := $(shell find crates sites vehicles scenarios platforms plants -type f 2>/dev/null) Cargo.toml Cargo.lock pyproject.toml

# Incremental builds take longer than full ones, and their programs are slower.
export CARGO_INCREMENTAL ?= 0
# `make test` repeats the same random cases; `cargo test` draws new ones.
export PROPTEST_RNG_SEED ?= 1

# All tests of a file run in one process and share its simulated drives. One process more than cores, because some
# tests only wait.
PYTEST := $(BIN)/python -m pytest --numprocesses $(shell expr $$(nproc 2>/dev/null || echo 1) + 1) \
  --dist loadscope --no-loadscope-reorder

# Reference vectors and recordings, next to the project.
DATA := $(abspath $(or $(ACCESS_AV_DATA),../shared/data))

.DEFAULT_GOAL := help
.PHONY: help demo live check test campaign attack test-radio test-aarch64 count-aarch64 dist package lint lint-python docs figures picture bench clean

help: ## List these commands
	@sed -n 's/^\([a-z0-9-]*\):.*## /  make \1\t/p' $(MAKEFILE_LIST) | expand -t 20

demo: .venv/installed ## Install into .venv, evaluate the paper, write results/latest/report.html
	$(BIN)/access-av paper evaluate

NODE := target/debug/access-av-node
live: .venv/installed-live $(NODE) ## Send a simulated drive to the node in real time, and open its page (Ctrl-C ends it)
	$(BIN)/python examples/live/live.py --node $(NODE) $(LIVE)

# With `--package`, features of dependencies differ, and `nr-ssb` and `onboard` are compiled again.
$(NODE): $(SOURCES)
	cargo build --workspace --bin access-av-node

check: lint ## Run formats, lints, types and the fast tests of both languages
	cargo test --workspace --exclude access-av-python --quiet --lib
	$(PYTEST) -m "not slow"

# Without examples, which clippy checks, and without the targets with `test = false` in their Cargo.toml, which have no
# unit tests. Linking them takes longer than all doc tests.
TESTED := --workspace --quiet --tests

test: lint ## Run formats, lints, types and all tests of both languages
	@if [ -d "$(DATA)" ]; then ACCESS_AV_DATA="$(DATA)" cargo test $(TESTED) -- --include-ignored --skip table_of_ --skip campaign_of_; \
	  else echo "not tested: reference vectors and recordings; no $(DATA) (ACCESS_AV_DATA)"; \
	  cargo test $(TESTED); fi
	cargo test --workspace --quiet --doc
	$(PYTEST)

campaign: attack ## Run `make attack`, thousands of random drives, and Ctrl-C at 20 times in each command (hours)
	cargo test $(TESTED) -- --ignored campaign_of_
	ACCESS_AV_INTERRUPTIONS=20 $(BIN)/python -m pytest tests/cli/test_interrupt.py

attack: .venv/installed-test $(NODE) ## Run random inputs, drives and plug-ins, and inject faults into the running node (SEED=… repeats; hours)
	$(BIN)/python -m attack $(if $(SEED),--seed $(SEED)) $(ATTACK)
	$(BIN)/python -m attack node $(if $(SEED),--seed $(SEED)) --out results/fault-campaign.json

test-radio: .venv/installed-test ## Build the node with SoapySDR (Debian: libsoapysdr-dev) and test it with a simulated radio
	cargo build --package access-av-node --features soapy
	$(BIN)/python -m pytest tests/vehicle/test_radio.py

AARCH64 := aarch64-unknown-linux-gnu
# Requirements of the cross compiler (Debian): gcc-aarch64-linux-gnu libc6-dev-arm64-cross qemu-user, and rustup with
# this target; or rustc-web cargo-web libstd-rust-web-dev:arm64 libc6:arm64.
EMULATED := CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_LINKER=aarch64-linux-gnu-gcc \
	CARGO_TARGET_AARCH64_UNKNOWN_LINUX_GNU_RUNNER=qemu-aarch64
export QEMU_LD_PREFIX ?= $(or $(wildcard /usr/aarch64-linux-gnu),/)
ifneq ($(wildcard /usr/lib/rustlib/$(AARCH64)),)
EMULATED += RUSTC=/usr/bin/rustc /usr/bin/cargo
else
EMULATED += cargo
endif

test-aarch64: .venv/installed-test ## Build the vehicle's programs for aarch64 and test them in an emulator
	@command -v aarch64-linux-gnu-gcc >/dev/null && command -v qemu-aarch64 >/dev/null || { echo \
	  "not tested: gcc-aarch64-linux-gnu, qemu-user, libc6-dev-arm64-cross, a Rust for $(AARCH64) needed"; exit 2; }
	cargo build --quiet --package access-av-node
	$(EMULATED) build --quiet --target $(AARCH64) -p access-av-node
	$(BIN)/python -m pytest tests/vehicle/test_aarch64.py
	$(EMULATED) test --quiet --target $(AARCH64) -p aoa-array -p nr-ssb -p onboard

count-aarch64: ## Count the instructions per estimate on aarch64: NEON and portable code
	$(filter-out /usr/bin/cargo cargo,$(EMULATED)) $(PYTHON) benches/aarch64_instructions.py $(lastword $(EMULATED))

DIST :=
dist: .venv/bin/python ## Build wheels, node binaries and Debian packages for x86-64 and aarch64 into dist/
	$(BIN)/python -m pip install --quiet 'maturin>=1.9,<2' 'ziglang>=0.13' 'cargo-zigbuild>=0.20'
	$(BIN)/python packaging/dist.py $(DIST)

ALONE := aoa-array nr-ssb
package: ## Pack the crates for independent use, and test each from its package
	cargo package --allow-dirty --no-verify $(ALONE:%=-p %)
	folder=$$(mktemp -d) && trap 'rm -rf "$$folder"' EXIT && for crate in $(ALONE); do \
	  tar -xf target/package/$$crate-[0-9]*.crate -C "$$folder" && \
	  cargo test --release --quiet --target-dir target/packaged --manifest-path "$$folder"/$$crate-*/Cargo.toml || exit 2; \
	done

# With the environment of maturin. Otherwise, clippy and the installation compile pyo3 and numpy again for each other.
CLIPPY = config=$$(ls -t target/maturin/pyo3-config-*.txt 2>/dev/null | head -n 1); \
  $${config:+env PYO3_BUILD_EXTENSION_MODULE=1 PYO3_CONFIG_FILE=$(CURDIR)/$$config} cargo clippy

lint: .venv/installed-test ## Check formats, lints and types of both languages
	cargo fmt --all --check
	$(CLIPPY) --workspace --all-targets --quiet -- -D warnings
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/stubtest access_av._core

docs: .venv/installed-docs ## Build the documentation site target/docs/site/index.html; warnings are errors
	$(BIN)/access-av file columns --markdown > docs/columns.md
	$(BIN)/python docs/site/build.py

figures: .venv/installed ## Evaluate the paper with five seeds (10 minutes) and make the figures of docs/paper.md
	$(BIN)/access-av paper evaluate --seeds 5 --sensitivity --out results/paper
	for name in ablation front sobol; do cp results/paper/$$name.svg docs/paper-$$name.svg; done

REPORT := results/latest/report.html
picture: ## Make the README's picture from the report of `access-av study bends` (needs chromium)
	$(BIN)/python docs/site/picture.py $(REPORT)

bench: .venv/installed-bench ## Compare angle estimators and cell search with other libraries; time the evaluation
	$(BIN)/python benches/aoa_peers.py
	$(BIN)/python benches/nr_peers.py
	$(BIN)/python benches/evaluation.py

clean: ## Remove all build products; results are kept
	rm -rf .venv target python/access_av/*.so

.venv/bin/python:
	$(PYTHON) -m venv .venv
	$(BIN)/python -m pip install --quiet --upgrade pip

# Prints the progress of the build, and its whole log if it fails.
define install
	@$(BIN)/python -m pip install --verbose --editable $(1) --config-settings build-args='--profile $(2)' 2>&1 \
	  | tee .venv/install.log \
	  | { grep --line-buffered -oE "(Downloading|Compiling) [^ ]+|Finished .release.*|Finished .dev.*" || true; } \
	  || { tail -n 60 .venv/install.log; exit 2; }
	@touch $@
endef

# The profile of the Rust tests: half the build time of a release, and integer overflow is checked.
.venv/installed: .venv/bin/python $(SOURCES)
	@echo "Building the Rust core: some minutes, once"
	$(call install,.,dev)
	@rm -f .venv/installed-bench

.venv/installed-test: .venv/bin/python $(SOURCES)
	@echo "Building the Rust core: some minutes, once"
	$(call install,'.[test]',dev)
	@rm -f .venv/installed-bench
	@touch .venv/installed

.venv/installed-live: .venv/installed
	$(call install,'.[live]',dev)

.venv/installed-docs: .venv/installed
	$(call install,'.[docs]',dev)

# The profile of the wheels.
.venv/installed-bench: .venv/bin/python $(SOURCES)
	@echo "Building the Rust core with every optimisation: some minutes, once"
	$(call install,'.[bench]',release)
	@rm -f .venv/installed .venv/installed-test
