# make setup  everything that is needed, in .venv        make test  the same, then the tests
# make demo   the same, then the main job                make clean forgets .venv and what tests and builds leave
# make pins   chooses the versions in constraints.txt anew (UPGRADE=--upgrade for the newest)
# make docs   these documents as pages, in docs/_build/html
# make bench-ball         how often the ball is caught (BENCH_ARGS="--seeds 5" for a look)
# make bench-estimation   estimators beside bounds and other libraries' filters (BENCH_ARGS=--quick for a look)

SHELL := /bin/bash
.SHELLFLAGS := -euo pipefail -c
.ONESHELL:
.PHONY: setup libraries test demo docs bench-ball bench-estimation pins clean

PYTHONS := python3.11 python3.12 python3.13 python3
VERSION_OK := import sys, ensurepip; sys.exit(not (3, 11) <= sys.version_info[:2] <= (3, 13))
PYTEST_ARGS ?=
BENCH_ARGS ?=
UPGRADE ?=

setup: libraries
	@stamp=.venv/.setup
	if [[ $$stamp -nt pyproject.toml && $$stamp -nt constraints.txt && "$$(cat $$stamp)" == "$$PWD" ]]; then exit 0; fi
	rm -f $$stamp
	if ! .venv/bin/python -c "$(VERSION_OK)" 2>/dev/null; then
	    for candidate in $(PYTHONS); do
	        if $$candidate -c "$(VERSION_OK)" 2>/dev/null; then python=$$candidate; break; fi
	    done
	    if [[ -z "$${python:-}" ]]; then
	        echo "setup: Python 3.11 to 3.13 with its venv module is needed; none of $(PYTHONS) is one" >&2
	        exit 2
	    fi
	    echo "setup: making .venv with $$($$python --version)"
	    rm -rf .venv
	    $$python -m venv .venv
	fi
	.venv/bin/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt uv
	.venv/bin/python -m uv pip install --python .venv/bin/python --constraint constraints.txt \
	    --build-constraint constraints.txt --editable '.[dev]'
	echo "$$PWD" > $$stamp

# The system libraries that Drake and its renderer load; without a Mesa driver the renderer ends the process.
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
	    echo "setup: system packages are missing; as root: apt-get install -y $${missing[*]}" >&2
	    exit 2
	fi

test: setup
	@.venv/bin/python -m pytest $(PYTEST_ARGS)

demo: setup
	@.venv/bin/drake-tracker run train --live

# What builds the pages is no part of the set-up either. A warning is an error: a link that leads nowhere, for one.
docs: setup
	@.venv/bin/python -m uv pip install --quiet --python .venv/bin/python --constraint constraints.txt \
	    --build-constraint constraints.txt --editable '.[docs]'
	.venv/bin/python -m sphinx --fresh-env -W --keep-going --quiet --builder html docs docs/_build/html
	echo "docs: open $$PWD/docs/_build/html/index.html"

bench-ball: setup
	@.venv/bin/python benchmarks/ball.py $(BENCH_ARGS)
	.venv/bin/python benchmarks/ball_detectors.py

# The filters of other libraries are for this benchmark alone, and no part of the set-up.
bench-estimation: setup
	@.venv/bin/python -m uv pip install --quiet --python .venv/bin/python --constraint constraints.txt \
	    --build-constraint constraints.txt --editable '.[bench]'
	.venv/bin/python benchmarks/estimation/run.py $(BENCH_ARGS)

pins:
	@.venv/bin/python -m uv pip compile --quiet --universal --python-version 3.11 --all-extras --no-header \
	    --no-annotate $(UPGRADE) --output-file constraints.txt pyproject.toml
	sed -i -E "s/ (and|;) implementation_name == 'cpython'//; s/ and sys_platform == 'linux'//" constraints.txt

clean:
	@rm -rf .venv .pytest_cache build dist docs/_build
	find . -name __pycache__ -prune -exec rm -rf {} +
