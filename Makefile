# Two commands, each from nothing: `make run` solves an actuator and shows where its report is,
# `make test` runs the tests. Both set up .venv first; later calls find it there.

PYTHON ?= python3
STUDY ?= composite_finger

run: .venv/ready
	.venv/bin/fem-spa study $(STUDY)

test: .venv/ready
	.venv/bin/python -m pytest -m "not slow"

.venv/ready: pyproject.toml
	@echo "setting up .venv, once; this downloads some hundred MB"
	$(PYTHON) -m venv .venv
	.venv/bin/python -m pip install --quiet --editable ".[dev]"
	touch .venv/ready

clean:
	rm -rf .venv out

.PHONY: run test clean
