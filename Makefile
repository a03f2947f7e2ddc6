# `make demo` and `make test` set up everything they need in .venv; nothing needs root.
PYTHON ?= python3
VENV := .venv
ROS := .venv-ros
BIN := $(VENV)/bin
PIP_INSTALL := $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt

.PHONY: help demo test test-browser test-ros editor check lint types imports spelling format bench train-compact train-best train-quick clean

help:
	@echo "make demo    drive an unseen office by topological map and write a report to look at"
	@echo "make test    the test suite (all but gpu, ros and browser)"
	@echo "make test-browser   the map editor's tests, in Chromium"
	@echo "make test-ros       the ROS 2 tests, in .venv-ros (Linux; needs g++ and cmake)"
	@echo "make editor  bundle the map editor's page again (needs Node 20)"
	@echo "make check   format, lint, types, imports, spelling"
	@echo "make bench   frame rates and closed-loop speed, stored under benchmarks/results/"
	@echo "make train-quick     preset best in a hurry (about half an hour)"
	@echo "make train-best      preset best from nothing (about three hours)"
	@echo "make train-compact   data set and training of the shipped weights (about an hour)"

$(VENV)/.created:
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(VENV)/.core: $(VENV)/.created pyproject.toml constraints.txt
	$(PIP_INSTALL) --editable .
	@touch $@

$(VENV)/.dev: $(VENV)/.core
	$(PIP_INSTALL) --editable ".[dev]"
	@touch $@

demo: $(VENV)/.core
	$(BIN)/toponav demo

test: $(VENV)/.dev
	$(BIN)/pytest -q -n 2 --dist loadfile -m "not gpu and not ros and not browser"

test-browser: $(VENV)/.dev
	$(BIN)/pytest -q -m browser

# ROS 2 from wheels runs Python again at every start, so it has an environment of its own on top
# of .venv.
$(ROS)/.ready: $(VENV)/.dev
	$(BIN)/python -m venv $(ROS)
	$(BIN)/python -c "import site; print('import site; site.addsitedir(%r)' % site.getsitepackages()[0])" \
	  > $$($(ROS)/bin/python -c "import site; print(site.getsitepackages()[0])")/toponav-shared.pth
	$(BIN)/python -c "import tomllib; print(*tomllib.load(open('pyproject.toml', 'rb'))['project']['optional-dependencies']['ros'], sep='\n')" > $(ROS)/requirements.txt
	$(ROS)/bin/python -m pip install --quiet --disable-pip-version-check -c constraints.txt -r $(ROS)/requirements.txt
	@touch $@

test-ros: $(ROS)/.ready
	TOPONAV_CACHE=$(CURDIR)/$(ROS)/cache $(ROS)/bin/python -m toponav.cli.main ros messages
	TOPONAV_CACHE=$(CURDIR)/$(ROS)/cache $(ROS)/bin/python -m pytest -n 2 --dist loadfile -q -m ros tests/ros

editor:
	npm --prefix editor ci --no-audit --no-fund
	npm --prefix editor run check
	npm --prefix editor run build

check: lint types imports spelling

lint: $(VENV)/.dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .

types: $(VENV)/.dev
	$(BIN)/mypy

imports: $(VENV)/.dev
	$(BIN)/lint-imports

spelling: $(VENV)/.dev
	$(BIN)/codespell toponav tests docs benchmarks examples *.md

format: $(VENV)/.dev
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

bench: $(VENV)/.core
	$(BIN)/toponav bench

train-compact: $(VENV)/.core
	bash examples/train_compact.sh

train-best: $(VENV)/.core
	bash examples/train_best.sh

train-quick: $(VENV)/.core
	bash examples/train_quick.sh

clean:
	rm -rf $(VENV) $(ROS) build dist *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis
