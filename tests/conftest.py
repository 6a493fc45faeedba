"""Bootstrap of the test suite: no display, no threads from other libraries."""

import os
import signal

import pytest

# Before anything imports matplotlib, or NumPy starts the threads of its linear algebra.
os.environ.setdefault("MPLBACKEND", "Agg")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def pytest_collection_modifyitems(items):
    """Everything below tests/validation is a validation test, marked or not."""
    for item in items:
        if "validation" in item.path.parts:
            item.add_marker(pytest.mark.validation)


@pytest.fixture(autouse=True, scope="session")
def interrupts_are_heard():
    """A shell starts background jobs with SIGINT ignored; tests of Ctrl-C want it heard."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)
