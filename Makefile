# Everything there is to do here. `make help` lists it.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check
INSTALL := VIRTUAL_ENV="$(CURDIR)/$(VENV)" $(BIN)/uv pip install --quiet --require-hashes --requirement
RUST_SOURCES := $(shell find crates -name '*.rs' -o -name Cargo.toml) Cargo.toml Cargo.lock
WEB_SOURCES := $(shell find web/src) web/build.mjs web/package-lock.json $(wildcard python/tumble/bench/static/*.css)
CORE_OF_PAGE := target/wasm32-unknown-unknown/web/tumble_web.wasm

# Crates that have tests, but for the fuzzers, which `make soak` runs.
TESTED := --workspace --exclude tumble-fuzz --exclude tumble-py --exclude tumble-web

# Strict: a link that leads nowhere, a page that no menu leads to, a name that does not exist end it. With --quiet none would.
SITE := NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict
RUSTDOC := RUSTDOCFLAGS="--deny warnings" cargo doc --quiet --no-deps --locked \
	$(foreach crate,core store capi lab,--package tumble-$(crate))

# Without it each program that tests start would compile all modules again.
unexport PYTHONDONTWRITEBYTECODE
# Sets have one order in all runs; `make soak` draws another.
export PYTHONHASHSEED ?= 0

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help build core-of-page web demo demo-bench demo-live firmware test test-one test-rust test-tools test-python test-commands coverage coverage-isolation sanitize mutants bench foreign flights soak package lint lint-rust lint-python generated site format requirements clean

help:  ## Say what can be made
	@sed -n 's/^\([a-z-]*\): .*## \(.*\)/\1\t\2/p' $(MAKEFILE_LIST) | expand -t 16

build: $(VENV)/.native  ## Build the native module and install the package into .venv

core-of-page: $(CORE_OF_PAGE)

web: out/web/tumble.html  ## Build the page that calibrates in a browser, one file for any server or disk: out/web/tumble.html

demo: $(VENV)/.native  ## Simulate a turntable session, calibrate five targets, write out/demo/turntable.html
	@$(BIN)/tumble demo -o out/demo

sanitize:  ## Interpret tests of the device's crates with Miri, run the C laws with the library under sanitizers (needs nightly Rust)
	scripts/check_miri.sh
	scripts/check_sanitized.sh

coverage-isolation:  ## Print the branches of the isolation that tests of Rust reach, and those that none does (needs nightly Rust)
	$(PYTHON) scripts/coverage_isolation.py

demo-bench: $(VENV)/.native  ## Serve the bench page on a simulated bench, until Ctrl-C
	@$(BIN)/tumble bench --simulated --folder out/bench

demo-live: $(VENV)/.native  ## Let a simulated rate table turn units that are heard live, and calibrate them; then a robot
	@$(BIN)/python examples/06_live_bench.py

firmware:  ## Fly a mission on an emulated Cortex-M4F, and compare it bit for bit with the host's replay
	@scripts/install_test_tools.sh qemu-system-arm
	@scripts/fly_firmware.sh

test: $(VENV)/.requirements-test  ## Run all tests: of Rust, of Python and devices, and the commands of the pages; print where the time went
	@# Each build ends with one crate on one core. Programs are downloaded meanwhile.
	@MAKE="$(MAKE)" $(BIN)/python scripts/timed_make.py test-rust+test-tools+build+core-of-page test-python test-commands

test-one: $(VENV)/.native $(VENV)/.requirements-test  ## Run the tests of one folder of Python's: make test-one P=noise
	$(BIN)/python -m pytest --numprocesses auto tests/$(P)

test-rust:  ## Run the tests of Rust
	cargo test $(TESTED) --locked
	cargo test --manifest-path firmware/Cargo.toml --target-dir target --locked

test-tools: $(VENV)/.requirements-test
	scripts/install_test_tools.sh
	scripts/install_postgres.sh

test-python: $(VENV)/.native test-tools web  ## Run the tests of Python, C and firmware
	$(BIN)/python -m pytest --numprocesses auto --max-worker-restart 0

coverage: $(VENV)/.native $(VENV)/.requirements-test  ## Run the tests of Python and print the share of lines and branches they reach
	$(BIN)/python -m pytest --numprocesses auto --cov --cov-report term:skip-covered

test-commands: $(VENV)/.native $(VENV)/.requirements-test  ## Run the commands of README and how-tos
	$(BIN)/python scripts/check_commands.py --run

bench: $(VENV)/.native $(VENV)/.requirements-test  ## Measure accuracy, speed and memory, print docs/benchmarks (forty minutes)
	$(BIN)/python -m benchmarks.accuracy
	$(BIN)/python -m benchmarks.disturbed
	$(BIN)/python -m benchmarks.stamps
	$(BIN)/python -m benchmarks.cases
	$(BIN)/python -m benchmarks.laboratories
	$(BIN)/python -m benchmarks.truths
	$(BIN)/python -m benchmarks.spin
	$(BIN)/python -m benchmarks.spin_live
	$(BIN)/python -m benchmarks.spin_disturbed
	$(BIN)/python -m benchmarks.multipose
	$(BIN)/python -m benchmarks.tremor
	$(BIN)/python -m benchmarks.magnetometer
	$(BIN)/python -m benchmarks.turntable_magnetometer
	$(BIN)/python -m benchmarks.spin_enough
	$(BIN)/python -m benchmarks.spin_chart
	$(BIN)/python -m benchmarks.noise_terms
	$(BIN)/python -m benchmarks.noise_disturbed
	$(BIN)/python -m benchmarks.noise_chart
	$(BIN)/python -m benchmarks.constant_rates
	$(BIN)/python -m benchmarks.thermal
	$(BIN)/python -m benchmarks.thermal_loops
	$(BIN)/python -m benchmarks.thermal_chart
	$(BIN)/python -m benchmarks.compare
	$(BIN)/python -m benchmarks.compare_chart
	$(BIN)/python -m benchmarks.drift
	$(BIN)/python -m benchmarks.registry
	$(BIN)/python -m benchmarks.certificates
	$(BIN)/python -m benchmarks.no_equipment
	$(BIN)/python -m benchmarks.redundancy
	$(BIN)/python -m benchmarks.speed
	$(BIN)/python -m benchmarks.production
	$(BIN)/python -m benchmarks.memory
	$(BIN)/python -m benchmarks.readers
	$(BIN)/python -m benchmarks.view
	$(BIN)/python -m benchmarks.bench_page
	$(BIN)/python -m benchmarks.live
	$(BIN)/python -m benchmarks.live_table
	$(BIN)/python -m benchmarks.fleet figures
	scripts/install_test_tools.sh qemu-system-arm gcc-arm-none-eabi
	$(BIN)/python -m benchmarks.footprint
	$(BIN)/python -m benchmarks.c_library
	$(BIN)/python -m benchmarks.report

soak: $(VENV)/.native $(VENV)/.requirements-test  ## Run what takes hours: 2000 drawn missions, power cuts of long sequences, hostile input
	seed=$$(od -An -N4 -tu4 /dev/urandom | tr -d ' '); echo "PYTHONHASHSEED=PROPTEST_RNG_SEED=$$seed"; \
		TUMBLE_SOAK=1 PYTHONHASHSEED=$$seed $(BIN)/python -m pytest --numprocesses auto --timeout 0 && \
		PROPTEST_RNG_SEED=$$seed PROPTEST_CASES=1024 cargo test $(TESTED) --locked
	$(BIN)/python -m benchmarks.honesty
	$(BIN)/python -m benchmarks.honesty --pair
	$(BIN)/python -m benchmarks.redundancy_adoptions
	$(BIN)/python -m benchmarks.redundancy_campaign
	$(BIN)/python -m benchmarks.redundancy_precision
	$(BIN)/python -m benchmarks.redundancy_campaign --aiding --kinds ramp --missions 300
	$(BIN)/python -m benchmarks.redundancy_recorded
	$(BIN)/python -m benchmarks.flights.campaign
	$(BIN)/python -m benchmarks.flights.compared
	$(BIN)/python -m benchmarks.redundancy_rests
	$(BIN)/python -m benchmarks.live --seconds 600 --hours 24
	$(BIN)/python -m benchmarks.fleet sessions
	$(BIN)/python -m benchmarks.fleet kills
	cargo test --locked --package tumble-store --test laws -- --ignored
	$(MAKE) sanitize
	$(MAKE) coverage-isolation
	cargo test --locked --package tumble-fuzz
	cargo run --locked --profile fuzz --package tumble-fuzz -- record
	cargo run --locked --profile fuzz --package tumble-fuzz -- spin
	cargo run --locked --profile fuzz --package tumble-fuzz -- monitor
	scripts/fuzz_calls.sh
	scripts/fuzz_guided.sh record
	scripts/fuzz_guided.sh spin
	scripts/fuzz_guided.sh monitor
	scripts/fuzz_guided.sh calls

mutants: $(VENV)/.native $(VENV)/.requirements-test  ## Put 500 drawn faults into crates and procedures, print how many the tests find (hours; FIRST=50 tries fewer)
	$(INSTALL) requirements/mutants.txt
	cargo install cargo-mutants --quiet --version 27.1.0 --locked --root target/mutants/cargo
	$(BIN)/python scripts/mutants.py $(if $(FIRST),--first $(FIRST))

package: $(VENV)/.native  ## Build what is released, and use it as a newcomer would; it is in out/package (ten minutes)
	$(INSTALL) requirements/package.txt
	rm -rf out/package
	$(BIN)/python scripts/build_packages.py out/package
	rustup target add aarch64-unknown-linux-gnu
	$(BIN)/python scripts/build_packages.py out/package --target aarch64-unknown-linux-gnu
	$(BIN)/python scripts/try_package.py out/package --extra all
	scripts/install_test_tools.sh cmake
	scripts/package_c.sh out/package
	$(BIN)/python scripts/package_arduino.py out/package
	scripts/build_image.sh

lint: $(VENV)/.native $(VENV)/.requirements-test  ## Check format, style, types, layers, language and documents
	@# Types and pages take one core, compilers the other.
	$(MAKE) --no-print-directory --jobs 2 --output-sync=target lint-rust lint-python

lint-rust:
	cargo fmt --all --check
	cargo clippy --workspace --all-targets --locked -- -D warnings
	scripts/lint_firmware.sh
	cargo test --quiet $(TESTED) --test header --test settings --locked
	$(RUSTDOC)

lint-python: out/web/tumble.html
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	web/node_modules/.bin/tsc --project web
	$(BIN)/python scripts/check_layers.py
	$(BIN)/python scripts/check_language.py
	$(BIN)/codespell
	$(BIN)/python scripts/check_commands.py
	$(BIN)/python -m benchmarks.report --check
	$(BIN)/python scripts/write_schemas.py --check
	$(BIN)/python scripts/write_settings.py --check
	$(BIN)/python scripts/write_records.py --check
	$(BIN)/python scripts/write_grades.py --check
	$(BIN)/python scripts/draw_map.py --check
	$(BIN)/python scripts/write_formats.py --check
	$(BIN)/python scripts/write_catalogues.py --check
	$(SITE)

generated: $(VENV)/.native $(VENV)/.requirements-test  ## Write all that is made from one table: settings, schemas, grades, formats, catalogues, tumble.h, tables of docs
	$(BIN)/python scripts/write_settings.py
	TUMBLE_WRITE_HEADER=1 cargo test --quiet --package tumble-capi --test header --locked
	$(MAKE) --no-print-directory $(VENV)/.native
	$(BIN)/python scripts/write_records.py
	$(BIN)/python scripts/write_schemas.py
	$(BIN)/python scripts/write_grades.py
	$(BIN)/python scripts/draw_map.py
	$(BIN)/python scripts/write_formats.py
	$(BIN)/python scripts/write_catalogues.py
	$(BIN)/python -m benchmarks.report

site: $(VENV)/.native $(VENV)/.requirements-test out/web/tumble.html  ## Build the documentation as a site, with that of the Rust crates: out/site/index.html
	$(SITE)
	$(RUSTDOC)
	cp -R target/doc out/site/rust
	cp out/web/tumble.html out/site

format: $(VENV)/.requirements-test  ## Put every source file into the agreed format
	cargo fmt --all
	cargo fmt --all --manifest-path firmware/Cargo.toml
	$(BIN)/ruff check --fix-only
	$(BIN)/ruff format

requirements: $(VENV)/.installer  ## Pin what pyproject.toml asks for; UPGRADE=--upgrade takes the newest versions
	scripts/pin_requirements.sh $(BIN) $(UPGRADE)

clean:  ## Remove everything that was built; sources and recordings stay
	rm -rf $(VENV) target out
	rm -f python/tumble/_core*.so

# The stamps below carry the date of the last success, so that a second run has next to nothing to do.

$(VENV)/.made: scripts/make_venv.sh
	scripts/make_venv.sh $(PYTHON) $(VENV)
	@touch $@

$(VENV)/.installer: $(VENV)/.made requirements/installer.txt
	$(PIP) install --quiet --require-hashes --requirement requirements/installer.txt
	@touch $@

$(VENV)/.requirements: $(VENV)/.installer requirements/run.txt
	$(INSTALL) requirements/run.txt
	@touch $@

$(VENV)/.requirements-test: $(VENV)/.requirements requirements/test.txt
	$(INSTALL) requirements/test.txt
	@touch $@

$(VENV)/.native: $(VENV)/.requirements $(RUST_SOURCES) pyproject.toml
	VIRTUAL_ENV="$(CURDIR)/$(VENV)" $(BIN)/maturin develop --release --locked
	@touch $@

$(CORE_OF_PAGE): $(RUST_SOURCES)
	TUMBLE_DEVICE_TARGET=wasm32-unknown-unknown scripts/cargo_for_device.sh build --locked --package tumble-web --profile web
	@touch $@

web/node_modules/.made: web/package-lock.json
	scripts/install_test_tools.sh nodejs npm
	npm ci --prefix web --ignore-scripts --silent
	@touch $@

out/web/tumble.html: $(CORE_OF_PAGE) web/node_modules/.made $(WEB_SOURCES) scripts/write_web_tables.py $(VENV)/.native $(VENV)/.requirements-test
	$(BIN)/python scripts/write_web_tables.py out/web/build/tables.json
	node web/build.mjs $(CORE_OF_PAGE)

flights:  ## Replay recorded flights of others that lie in FOLDER through the redundancy monitor
	$(BIN)/python -m benchmarks.flights.logs $(FOLDER)
	$(BIN)/python -m benchmarks.report

foreign:  ## Compare recordings of others that lie in FOLDER with what independent readers find
	$(BIN)/python tests/support/foreign.py $(FOLDER) --table docs/how-to/read-logs.md
