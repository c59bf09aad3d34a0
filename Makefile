# Everything goes through the virtual environment in .venv; the first target that needs it makes it.
# Another Python: make setup PYTHON=python3.12
.DEFAULT_GOAL := help
.PHONY: help setup demo regress test lint format clean

BIN := .venv/bin
READY := .venv/ready
REGRESS := reports/runs/regress-$(shell date +%Y%m%dT%H%M%S)

help: ## this list
	@awk -F ':.*## ' '/^[a-z]+:.*## / {printf "  make %-8s %s\n", $$1, $$2}' Makefile

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

test: $(READY) ## set up and run every test
	$(BIN)/pytest --durations=10

lint: $(READY) ## style, formatting, types, and the one-way layers
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports

format: $(READY) ## rewrite what can be mended by a tool
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

clean: ## remove what the tools left behind; keeps .venv and the runs in reports/
	rm -rf build dist .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache htmlcov .coverage
	find burrscan scenes bench tests -name __pycache__ -type d -prune -exec rm -rf {} +
