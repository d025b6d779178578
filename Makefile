# make demo and make test do all the set-up: python3 with its venv module and g++ are enough.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
SOURCES := pyproject.toml CMakeLists.txt $(shell find cpp python robots -type f -not -name '*.pyc')

# Writes the type stubs of the compiled module below a folder.
define stubs
$(BIN)/pybind11-stubgen graspatlas._core --output-dir $(1) --numpy-array-use-type-var --exit-code
$(BIN)/ruff format --quiet --config pyproject.toml $(1)/graspatlas/_core.pyi
endef

.PHONY: demo test test-slow sanitize bench compare docs lint stubs format wheel clean

demo: $(VENV)/.installed
	$(BIN)/graspatlas optimize schunk_can --require force_closure:0.5:0.02 --require collision_free --refine --output out/schunk_can
	$(BIN)/graspatlas view out/schunk_can --picture out/schunk_can/grasps.png --html out/schunk_can/grasps.html
	@echo "Open out/schunk_can/grasps.html in a browser, or run: $(BIN)/graspatlas view out/schunk_can"

# On two processes, which take tests from each other's end when they run out; fixtures are computed once in each.
PYTEST := $(BIN)/python -m pytest -n 2 --dist worksteal

# What to run while working: every module's main behaviour, in about four minutes.
test: $(VENV)/.tools
	$(PYTEST) -m "not slow"

# The rest: large atlases, all examples, whole reproductions, many runs.
test-slow: $(VENV)/.tools
	$(PYTEST) -m slow

# The C++ core under the compiler's sanitizers; SANITIZE=thread looks for data races instead.
SANITIZE ?= address,undefined
sanitize: $(VENV)/.tools
	$(BIN)/cmake -Wno-dev -S tests/sanitize -B build/sanitize -DPython_EXECUTABLE=$(CURDIR)/$(BIN)/python -DSANITIZE=$(SANITIZE)
	$(BIN)/cmake --build build/sanitize --parallel 2
	build/sanitize/sanitize

bench: $(VENV)/.tools
	$(BIN)/python benchmarks/run.py

# Against OMPL, SciPy and NumPy, how cost grows, and which k can be afforded; writes benchmarks/RESULTS.md, and the table
# of docs/hand_motions.md, in about twelve minutes.
compare: $(VENV)/.tools
	$(BIN)/python -m pip install --quiet "graspatlas[compare]"
	$(BIN)/python benchmarks/compare.py

# The documentation site, in build/docs/html; warnings are errors. It needs the network for Sphinx alone, the first time.
# EXPLORER=planar_hand,schunk_can solves these bundled problems alone for the pages behind the gallery.
EXPLORER ?=
docs: $(VENV)/.docs
	$(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet --jobs auto $(if $(EXPLORER),-D explorer_problems=$(EXPLORER)) \
	  --doctree-dir build/docs/doctrees docs build/docs/html
	@echo "Open build/docs/html/index.html in a browser."

lint: $(VENV)/.tools
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/clang-format --dry-run --Werror $$(git ls-files '*.cpp' '*.hpp')
	$(BIN)/mypy
	$(call stubs,build/stubs)
	diff build/stubs/graspatlas/_core.pyi python/graspatlas/_core.pyi

format: $(VENV)/.tools
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .
	$(BIN)/clang-format -i $$(git ls-files '*.cpp' '*.hpp')

# Type stubs of the compiled module, from the module itself.
stubs: $(VENV)/.tools
	$(call stubs,python)

# This platform's wheel, and what it must be: no larger than 4 MB, of sound metadata, and working in an environment of its
# own, without a compiler or anything else but Python in reach and without the network when it runs.
FRESH := build/fresh
ALONE := env -i PATH=$(CURDIR)/$(FRESH)/bin HOME=$(CURDIR)/$(FRESH)
wheel: $(VENV)/bin/python
	$(BIN)/python -m pip install --quiet "build>=1.2" "twine>=7" "check-wheel-contents>=0.6"
	rm -rf dist $(FRESH)
	$(BIN)/python -m build --outdir dist
	$(BIN)/twine check --strict dist/*
	$(BIN)/check-wheel-contents dist/*.whl
	test $$(cat dist/*.whl | wc -c) -le 4000000
	$(PYTHON) -m venv $(FRESH)
	$(ALONE) $(FRESH)/bin/python -m pip install --quiet $$(ls dist/*.whl)
	! $(ALONE) $(FRESH)/bin/python -c "import shutil, sys; sys.exit(not any(map(shutil.which, ['c++', 'g++', 'clang++'])))"
	$(ALONE) $(FRESH)/bin/graspatlas optimize schunk_can --require force_closure:0.5:0.02 --require collision_free --refine
	$(ALONE) $(FRESH)/bin/python tests/wheel_smoke.py

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --upgrade pip

$(VENV)/.installed: $(VENV)/bin/python $(SOURCES)
	$(BIN)/python -m pip install .
	touch $@

$(VENV)/.tools: $(VENV)/bin/python $(SOURCES)
	$(BIN)/python -m pip install ".[test,lint,stubs,sanitize,docs]"
	touch $(VENV)/.installed $(VENV)/.docs $@

$(VENV)/.docs: $(VENV)/.installed
	$(BIN)/python -m pip install --quiet "graspatlas[docs]"
	touch $@

clean:
	rm -rf $(VENV) build dist out
