# Two commands do everything on a machine with git, make, python3 (3.11 or newer) and pip:
#   make demo    the plate with a hole: pictures, ParaView files and a table in out/
#   make test    the tests
# The others: docs (the site), verify (the book), kernels (bounds checked, and as plain Python), dist,
# examples, bench, slow, lint, clean.

PYTHON ?= python3
BIN := .venv/bin
export MPLBACKEND ?= Agg
export PYVISTA_OFF_SCREEN ?= true

.PHONY: demo test slow lint examples bench verify kernels docs dist environment clean

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

verify: environment
	$(BIN)/python -m xcrack verify --quick -o out/book.html

# A folder of their own for machine code with checks: numba does not tell them from other code.
kernels: environment
	NUMBA_BOUNDSCHECK=1 NUMBA_CACHE_DIR=$(CURDIR)/.cache/numba/bounds $(BIN)/python -m pytest tests/kernels
	NUMBA_DISABLE_JIT=1 $(BIN)/python -m pytest tests/kernels

docs: environment
	$(BIN)/python -m pip install --quiet -e ".[docs]"
	$(BIN)/python -m sphinx -W --keep-going -b html docs out/site

dist: environment
	$(BIN)/python -m pip install --quiet build
	$(BIN)/python -m build --outdir dist

environment:
	@$(PYTHON) scripts/bootstrap.py

clean:
	rm -rf out .cache build dist .pytest_cache .mypy_cache .ruff_cache .import_linter_cache .hypothesis
