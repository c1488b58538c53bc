# Two commands do everything on a fresh Debian or Ubuntu machine with Rust:
#   make demo   capture, trace and replay the built-in scenes; write two reports into out/
#   make test   run every test
# The rest is for daily work.

CARGO ?= cargo
OUT   ?= out
# Where `make install` puts bin, lib and share.
PREFIX ?= $(HOME)/.local
# Folder of the real scenes (docs/use/real-scenes.md).
SCENES ?= $(OUT)/scenes

.PHONY: demo dist wheel install apps techniques accuracy stress notebooks test fuzz faults bench lint programs build deps golden figures reproduce clean screenshots scenes scene-files

demo: deps programs
	@OUT="$(OUT)" scripts/demo.sh

# An archive and a Python wheel, which run without Rust, in $(OUT)/dist (docs/use/install.md).
dist: KINDS = archive wheel
# The wheel alone.
wheel: KINDS = wheel
dist wheel:
	$(CARGO) build --release --locked -p tracegen -p replay -p layer -p xr -p parallax-python
	@python3 -B scripts/dist.py "$${CARGO_TARGET_DIR:-target}/release" "$(OUT)/dist" $(KINDS)

install: build
	@python3 -B scripts/dist.py "$${CARGO_TARGET_DIR:-target}/release" "$(DESTDIR)$(PREFIX)" install

# Unmodified programs: two web pages in headless Chromium, captured and replayed (docs/use/applications.md).
apps: deps build
	@python3 -m studies apps --two-pages --out "$(OUT)"

# Every stereo rendering technique on three scenes, measured against its image error.
techniques: deps build
	@python3 -m studies techniques --out "$(OUT)"

# Numbers that try to break a capture: errors and bounds in $(OUT)/stress/stress.md, about two minutes.
stress: deps build
	@$${CARGO_TARGET_DIR:-target}/release/tracegen stress -o "$(OUT)/stress"

# Run time against error, from capture precision to techniques: a page in $(OUT)/accuracy.
accuracy: deps build
	@python3 -m studies accuracy --out "$(OUT)" --results "$(OUT)/accuracy"

# The wheel in a fresh virtual environment with packages from PyPI: its notebooks in empty folders, and its tests (docs/use/python.md).
notebooks: wheel
	@OUT="$(OUT)" PARALLAX_WHEEL="$$(ls -t "$(OUT)"/dist/*.whl | head -n 1)" scripts/notebooks.sh

test:
	@scripts/install-deps.sh test
	@CARGO="$(CARGO)" scripts/test.sh

# Every reader of foreign bytes under a coverage-guided fuzzer, SECONDS each (docs/results/robustness.md).
SECONDS ?= 60
fuzz:
	@OUT="$(OUT)" scripts/fuzz.sh -t $(SECONDS)

# Programs killed at 200 random moments, and disks that are full at many sizes.
faults:
	KILLS=200 STEPS=20 $(CARGO) test --release --workspace --locked --test e2e -- kills:: full_disk:: --nocapture

# What each stage of a replay costs, beside this machine's bandwidth (TEXTRACE=file for another trace).
bench:
	@$(CARGO) bench --locked -p replay --bench engine

lint:
	$(CARGO) fmt --all --check
	$(CARGO) clippy --release --workspace --all-targets --locked -- -D warnings

# Both programs as the demo needs them: without the commands that capture programs, without checks of captures, and without decoders of files.
programs:
	$(CARGO) build --release --locked --no-default-features -p tracegen -p replay

build:
	$(CARGO) build --release --locked -p tracegen -p replay -p layer -p xr

# lavapipe is the only thing that the programs need from outside Cargo.
deps:
	@scripts/install-deps.sh

# Rewrites the golden traces and results; review the diff.
golden: deps build
	scripts/golden.sh

# Rewrites the tables of the documents from results/, and the outputs of the tutorial; review the diff.
figures: build
	UPDATE_FIGURES=1 $(CARGO) test --release --locked --workspace --test e2e -- figures:: tutorial::

# Every page from small inputs, with screenshots and a check of their layout: out/screenshots.
screenshots: deps build
	@python3 -m studies screenshots --out "$(OUT)"

# Fetches and converts the real scenes that may be had by address, into $(SCENES).
scenes:
	@scripts/scenes.sh "$(SCENES)"

# Draws the glTF files of published packages and writes results/scene-files.csv, about ten minutes (docs/use/scene-files.md).
scene-files: deps build
	@python3 -m studies scene-files --out "$(OUT)"

# Measures the tables of the documents again and prints what moved (docs/use/real-scenes.md):
#   make reproduce SCENES=folder STUDIES="policies levels"
reproduce: deps build
	@python3 -m studies reproduce $(STUDIES) --out "$(OUT)" --scenes "$(SCENES)"

clean:
	$(CARGO) clean
	rm -rf "$(OUT)"
