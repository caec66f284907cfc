# make compare   compare the machines of the catalogue (sets up .venv first; needs Python >= 3.11 and a network, once)
# make test      lint, types, layers and all tests
# make docs      the pages as a site in build/site (no network needed, nor to read it)
# make bench     timings
# make clean     remove everything that is made

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet

.PHONY: help compare test docs bench clean

help:
	@sed -n 's/^# \(make .*\)/\1/p' $(firstword $(MAKEFILE_LIST))

compare: $(VENV)/.runtime
	@mkdir -p trivet-results
	$(BIN)/trivet compare --figure trivet-results/compare.png --figure trivet-results/compare.html --data trivet-results/compare.nc --overwrite
	@echo "figures and data: trivet-results/compare.png, compare.html, compare.nc"

test: $(VENV)/.dev
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/pytest -rs -n auto --maxprocesses 4 --dist worksteal

docs: $(VENV)/.dev
	$(BIN)/sphinx-build -W --keep-going -q -d build/doctrees docs build/site
	@echo "open build/site/index.html"

bench: $(VENV)/.dev
	$(BIN)/python -m benchmarks

clean:
	rm -rf $(VENV) build dist .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache trivet-results reproduction
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# Stamps: set up again only when what is to be installed has changed.
$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "trivet needs Python 3.11 or later; name one with: make PYTHON=python3.12 $(MAKECMDGOALS)" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)

$(VENV)/.runtime: pyproject.toml constraints.txt | $(BIN)/python
	$(PIP) install -c constraints.txt -e .
	@touch $@

# A peer that cannot be had here (no wheel for this machine, say) must not keep the rest from being tested: then one by one.
$(VENV)/.dev: $(VENV)/.runtime
	@$(PIP) install -c constraints.txt -e '.[dev,peers]' || { $(PIP) install -c constraints.txt -e '.[dev]' && \
	for peer in $$($(BIN)/python -c "import tomllib; print(*tomllib.load(open('pyproject.toml', 'rb'))['project']['optional-dependencies']['peers'])"); do \
	  $(PIP) install -c constraints.txt "$$peer" || echo "peer $$peer cannot be installed here; tests that need it are skipped"; \
	done; }
	@touch $@
