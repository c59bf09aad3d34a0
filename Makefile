# Everything goes through the virtual environment in .venv; the first target that needs it makes it.
# Another Python: make setup PYTHON=python3.12
.DEFAULT_GOAL := help
.PHONY: help setup demo regress test studies test-fast coverage docs lint format clean

# set where files shall not be written, it would have each of many processes compile every source anew
unexport PYTHONDONTWRITEBYTECODE

BIN := .venv/bin
READY := .venv/ready
DOCS := .venv/docs
# a file at a time to each of up to four processes, for what a file shares is made once; the longest first
EVERY_CORE := -n logical --maxprocesses 4 --dist loadfile --no-loadscope-reorder
REGRESS := reports/runs/regress-$(shell date +%Y%m%dT%H%M%S)

help: ## this list
	@awk -F ':.*## ' '/^[a-z-]+:.*## / {printf "  make %-9s %s\n", $$1, $$2}' Makefile

setup: $(READY) ## make .venv with burrscan and its tools; on Debian as root also a usable LLVM

$(READY): pyproject.toml .ci/setup .ci/constraints.txt
	@.ci/setup .venv
	@touch $@

demo: $(READY) ## set up, run the suite 'quick' and say where its report is
	$(BIN)/burrscan run quick

regress: $(READY) ## run the suite 'quick' against its accepted baseline; fails when something is worse
	$(BIN)/burrscan run quick --out $(REGRESS)
	$(BIN)/burrscan compare reports/baselines/quick $(REGRESS) --markdown $(REGRESS)/compare.md \
	  --junit $(REGRESS)/compare.xml --json $(REGRESS)/compare.json

test: $(READY) ## set up and run the tests; on Debian as root also the browser and shells that some use
	@.ci/extras $(BIN)/python
	$(BIN)/pytest $(EVERY_CORE) --durations=10 -rs

studies: $(READY) ## the tests that `make test` leaves out: more draws, more shapes, larger meshes; CI runs them too
	@.ci/extras $(BIN)/python
	$(BIN)/pytest $(EVERY_CORE) -m study --durations=10 -rs

test-fast: $(READY) ## the tests that take a minute together, while you write
	$(BIN)/pytest $(EVERY_CORE) -m "not slow and not study"

coverage: $(READY) ## every test, and which lines they reach: htmlcov/index.html
	@.ci/extras $(BIN)/python
	$(BIN)/coverage erase
	$(BIN)/coverage run -m pytest -m ""
	$(BIN)/coverage combine --quiet
	$(BIN)/coverage html --quiet
	$(BIN)/coverage report

docs: $(DOCS) ## the documentation site: site/index.html
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet

$(DOCS): $(READY)
	$(BIN)/python -m pip --disable-pip-version-check --quiet install --constraint .ci/constraints.txt --editable '.[docs]'
	@touch $@

lint: $(READY) ## style, formatting, types, spelling, and the one-way layers
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/codespell
	$(BIN)/lint-imports

format: $(READY) ## rewrite what can be mended by a tool
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

clean: ## remove what the tools left behind; keeps .venv and the runs in reports/
	rm -rf build dist site .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache htmlcov .coverage .coverage.*
	find burrscan scenes bench tests -name __pycache__ -type d -prune -exec rm -rf {} +
