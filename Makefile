# Everything runs through tools/setup_env.py, which sets up what is missing first.
ifndef PYTHON
PYTHON := $(firstword $(foreach name,python3.11 python3.12 python3,$(if $(shell $(name) -c "" 2>/dev/null && echo yes),$(name))))
endif
ENV = $(PYTHON) tools/setup_env.py
DEV = $(ENV) --dev
# Two test processes of one thread each: small operations on spinning threads are slower than on one.
export OMP_NUM_THREADS ?= 1
export OMP_WAIT_POLICY ?= passive

.PHONY: demo test lint format setup screenshots need-python

# The embedded session in the window; without a display, how close its solve comes to the known truth.
demo: need-python
	$(ENV) markerscope demo --out demo-out

# Everything that must hold.
test: lint
	$(DEV) python -m pytest -q -n 2

lint: need-python
	$(DEV) ruff check .
	$(DEV) ruff format --check .
	$(DEV) mypy

format: need-python
	$(DEV) ruff check --fix .
	$(DEV) ruff format .

# The pictures of the manual, made without a display.
screenshots: need-python
	$(DEV) python tools/screenshots.py

setup: need-python
	$(DEV)

need-python:
	@test -n "$(PYTHON)" || { echo "Python 3.11 or 3.12 is needed (on Debian 12: apt-get install python3 python3-venv)." >&2; exit 1; }
