# Two commands do everything on a machine with git, make, python3 (3.11 or newer) and pip:
#   make demo    the plate with a hole: pictures, ParaView files and a table in out/
#   make test    the tests
# The others: examples, bench, slow, lint, clean.

PYTHON ?= python3
BIN := .venv/bin
export MPLBACKEND ?= Agg
export PYVISTA_OFF_SCREEN ?= true

.PHONY: demo test slow lint examples bench environment clean

demo: environment
	$(BIN)/python examples/plate_with_hole.py

test: environment
	$(BIN)/python -m pytest -n 2

slow: environment
	$(BIN)/python -m pytest -n 2 -m slow

lint: environment
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

examples: environment
	@set -e; for script in examples/*.py; do echo "== $$script"; $(BIN)/python $$script; done

bench: environment
	$(BIN)/python -m pip install --quiet "scikit-fem>=10" || echo "without scikit-fem: no baseline"
	$(BIN)/python -m benchmarks --out benchmarks/results --figures docs/figures

environment:
	@$(PYTHON) scripts/bootstrap.py

clean:
	rm -rf out .cache build .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
