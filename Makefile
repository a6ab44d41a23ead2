# Two commands do everything: `make demo` and `make test`. Both make their own environment in .venv.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
OUT ?= out/demo

.PHONY: help demo serve test lint types bench docs constraints clean

help:
	@echo "make demo    run the main job in a simulated world; results in $(OUT)"
	@echo "make serve   the live system with its console in the browser, in the same world"
	@echo "make test    run all tests"
	@echo "make lint    ruff, mypy, import layers"
	@echo "make bench   speed and accuracy beside peers"
	@echo "make docs    refresh the figures and the command line's help in docs/"

$(VENV)/made: pyproject.toml constraints.txt
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "airground needs Python 3.11 or newer; set PYTHON=/path/to/python3.11" >&2; exit 2; }
	@$(PYTHON) -m venv $(VENV) \
	  || { echo "cannot make a virtual environment; on Debian: apt install python3-venv" >&2; exit 2; }
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable .
	@touch $@

$(VENV)/made-test: $(VENV)/made
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[test]'
	@touch $@

$(VENV)/made-dev: $(VENV)/made-test
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[dev]'
	@touch $@

# Programs of others that the tests talk to: a streaming ffmpeg, an RTSP server, a browser, OpenGL without a screen.
PEERS := ffmpeg chromium fonts-dejavu-core python3-gi gir1.2-gstreamer-1.0 gir1.2-gst-rtsp-server-1.0 \
  gstreamer1.0-plugins-base gstreamer1.0-plugins-good gstreamer1.0-plugins-bad gstreamer1.0-plugins-ugly \
  libegl1 libopengl0 libgl1-mesa-dri

$(VENV)/made-peers: $(VENV)/made
	@if [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null; then \
	  { apt-get update -qq && DEBIAN_FRONTEND=noninteractive \
	    apt-get install -y -qq --no-install-recommends $(PEERS); } >$(VENV)/peers.log 2>&1 \
	  || echo "make: could not install $(PEERS): tests with a real stream, browser or OpenGL will be skipped, see $(VENV)/peers.log"; \
	else echo "make: not root, or no apt-get: tests with a real stream, browser or OpenGL need $(PEERS) and are skipped without"; fi
	@touch $@

demo: $(VENV)/made
	$(BIN)/airground demo --out $(OUT)

serve: $(VENV)/made
	$(BIN)/airground serve

test: $(VENV)/made-test $(VENV)/made-peers lint
	$(BIN)/python -m pytest --numprocesses auto --dist loadscope

lint: $(VENV)/made-test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

bench: $(VENV)/made-dev
	$(BIN)/python benchmarks/read_csv.py
	$(BIN)/python benchmarks/calibrate.py
	$(BIN)/python benchmarks/recordings.py
	$(BIN)/python benchmarks/uncertainty.py
	$(BIN)/python benchmarks/coverage.py
	$(BIN)/python benchmarks/robust.py
	$(BIN)/python benchmarks/trajectory.py
	$(BIN)/python benchmarks/faults.py --seeds 5
	$(BIN)/python benchmarks/online.py
	$(BIN)/python benchmarks/guidance.py
	$(BIN)/python benchmarks/detectors.py
	$(BIN)/python benchmarks/tracker.py --seeds 2 --seconds 10
	$(BIN)/python benchmarks/identify.py
	$(BIN)/python benchmarks/moving.py images
	$(BIN)/python benchmarks/moving.py rendered
	$(BIN)/python benchmarks/render.py
	$(BIN)/python benchmarks/eyes.py
	$(BIN)/python benchmarks/driving.py
	$(BIN)/python benchmarks/drive_peers.py
	$(BIN)/python benchmarks/state_filter.py
	$(BIN)/python benchmarks/sketch.py
	$(BIN)/python benchmarks/separation.py --scenes 40
	$(BIN)/python benchmarks/separation_solvers.py
	$(BIN)/python benchmarks/safety.py
	$(BIN)/python benchmarks/legs.py 3
	$(BIN)/python benchmarks/live.py latency
	$(BIN)/python benchmarks/live.py stop
	$(BIN)/python benchmarks/live.py memory --minutes 5

docs: $(VENV)/made-test
	$(BIN)/python docs/refresh.py

# No lock file that names a registry: versions only, for every Python and system at once.
constraints: $(VENV)/made-dev
	$(BIN)/uv pip compile --quiet --universal --python-version 3.11 --all-extras --no-annotate --upgrade \
	  --custom-compile-command "make constraints" pyproject.toml --output-file constraints.txt

clean:
	rm -rf $(VENV) out .mypy_cache .pytest_cache .ruff_cache .hypothesis .import_linter_cache
