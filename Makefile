# make install   installs what a run needs into .venv
# make demo      does so, runs the train and shows it in a browser
# make setup     installs the tools of developers too; every target below does so first
# make lint      checks style, format and types
# make test      runs the tests (PYTEST_ARGS="tests/vision -k window" for some, WORKERS=1 for one process)
# make notebooks runs every notebook (make test runs the two shortest)
# make coverage  runs the tests and reports the lines that they do not reach; pages in build/coverage
# make docs      builds the documentation in docs/_build/html
# make pins      updates the versions in constraints.txt (UPGRADE=--upgrade for the newest)
# make clean     removes .venv and everything that tests and builds leave
# make bench-ball         measures how often the ball is caught (BENCH_ARGS="--seeds 5" for a quick look)
# make bench-estimation   compares the estimators with bounds and with filters of other libraries (BENCH_ARGS=--quick)

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.ONESHELL:
.PHONY: setup install libraries lint test notebooks coverage demo docs bench-ball bench-estimation pins clean

PYTHONS ?= python3.11 python3.12 python3.13 python3
VERSION_OK := import sys, ensurepip; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))
PYTEST_ARGS ?=
WORKERS ?= $(shell cores=$$(nproc); echo $$((cores < 2 ? cores : 2)))
# One thread for each worker: the renderer's and the linear algebra's own threads would only compete for the cores.
PYTEST := LP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 .venv/bin/python -m pytest -n $(WORKERS) --dist worksteal
BENCH_ARGS ?=
UPGRADE ?=

# Installs the package with extras into .venv, unless that is done. $(1): extras, such as [dev]; $(2): file that says so.
define install
	stamps=($(2) .venv/.setup)
	for stamp in "$${stamps[@]}"; do
	    if [[ $$stamp -nt pyproject.toml && $$stamp -nt constraints.txt && "$$(cat $$stamp)" == "$$PWD" ]]; then exit 0; fi
	done
	rm -f $(2)
	if ! .venv/bin/python -c "$(VERSION_OK)" 2>/dev/null; then
	    for candidate in $(PYTHONS); do
	        if $$candidate -c "$(VERSION_OK)" 2>/dev/null; then python=$$candidate; break; fi
	    done
	    if [[ -z "$${python:-}" ]]; then
	        echo "setup: needs Python 3.11 to 3.13 with its venv module; none of $(PYTHONS) will do" >&2
	        exit 2
	    fi
	    echo "setup: creating .venv with $$($$python --version)"
	    rm -rf .venv
	    $$python -m venv .venv
	fi
	echo "setup: installing packages into .venv (the first time this takes some minutes)"
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt uv
	.venv/bin/python -m uv pip install --python .venv/bin/python --constraint constraints.txt \
	    --build-constraint constraints.txt --editable '.$(1)'
	# Otherwise every start compiles the modules again where Python may not write bytecode.
	.venv/bin/python -m compileall -q -j $$(nproc) .venv/lib drake_tracker
	echo "$$PWD" > $(2)
endef

setup: libraries
	@$(call install,[dev],.venv/.setup)

# What a run needs, without the tools of developers.
install: libraries
	@$(call install,,.venv/.install)

# The system libraries that Drake and its renderer load. Without a Mesa driver the renderer crashes the process.
libraries:
	@missing=()
	has() { /sbin/ldconfig -p | grep -F "$$1 " > /dev/null; }
	has libglib-2.0.so.0 || missing+=(libglib2.0-0)
	has libEGL.so.1 || missing+=(libegl1)
	compgen -G '/usr/lib/*/dri/swrast_dri.so' > /dev/null || compgen -G '/usr/lib/*/libgallium*.so' > /dev/null \
	    || missing+=(libgl1-mesa-dri)
	found=
	for candidate in .venv/bin/python $(PYTHONS); do
	    if $$candidate -c "$(VERSION_OK)" 2>/dev/null; then found=yes; break; fi
	done
	[[ $$found ]] || missing+=(python3-venv)
	if (( $${#missing[@]} == 0 )); then exit 0; fi
	if (( EUID == 0 )) && command -v apt-get > /dev/null; then
	    echo "setup: installing $${missing[*]}"
	    apt-get update -qq
	    DEBIAN_FRONTEND=noninteractive apt-get install -y -qq --no-install-recommends "$${missing[@]}"
	else
	    echo "setup: system packages are missing; run as root: apt-get install -y $${missing[*]}" >&2
	    exit 2
	fi

lint: setup
	@.venv/bin/ruff check
	.venv/bin/ruff format --check
	.venv/bin/mypy

test: setup
	@$(PYTEST) $(PYTEST_ARGS)

notebooks: setup
	@ALL_NOTEBOOKS=1 $(PYTEST) tests/test_notebooks.py

coverage: setup
	@$(PYTEST) --cov --cov-report=term --cov-report=html $(PYTEST_ARGS)
	echo "coverage: open $$PWD/build/coverage/index.html"

demo: install
	@echo "demo: the train is tracked and grasped; this takes about a minute. Open the link to watch it"
	.venv/bin/drake-tracker run train --live

# Sphinx is not part of the setup. A warning, such as a broken link, is an error.
docs: setup
	@.venv/bin/python -m uv pip install --quiet --python .venv/bin/python --constraint constraints.txt \
	    --build-constraint constraints.txt --editable '.[docs]'
	.venv/bin/python -m sphinx --fresh-env -W --keep-going --quiet --builder html docs docs/_build/html
	echo "docs: open $$PWD/docs/_build/html/index.html"

bench-ball: setup
	@.venv/bin/python benchmarks/ball.py $(BENCH_ARGS)
	.venv/bin/python benchmarks/ball_detectors.py

# The filters of other libraries are not part of the setup: only this benchmark uses them.
bench-estimation: setup
	@.venv/bin/python -m uv pip install --quiet --python .venv/bin/python --constraint constraints.txt \
	    --build-constraint constraints.txt --editable '.[bench]'
	.venv/bin/python benchmarks/estimation/run.py $(BENCH_ARGS)

pins:
	@.venv/bin/python -m uv pip compile --quiet --universal --python-version 3.11 --all-extras --no-header \
	    --no-annotate $(UPGRADE) --output-file constraints.txt pyproject.toml
	sed -i -E "s/implementation_name == 'cpython' and //; s/ (and|;) implementation_name == 'cpython'//
	    s/platform_python_implementation != 'PyPy' and //; s/ (and|;) platform_python_implementation != 'PyPy'//
	    s/ (and|;) sys_platform == 'linux'//" constraints.txt

clean:
	@rm -rf .venv .pytest_cache .mypy_cache .ruff_cache .coverage build dist docs/_build docs/tutorials/*.ipynb
	find . -name __pycache__ -prune -exec rm -rf {} +
