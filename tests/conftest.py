"""Bootstrap of the test suite: no display, no threads from other libraries."""

import os

import pytest

# Before anything imports matplotlib, or NumPy starts the threads of its linear algebra.
os.environ.setdefault("MPLBACKEND", "Agg")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def pytest_collection_modifyitems(items):
    """Everything below tests/validation is a validation test, marked or not."""
    for item in items:
        if "validation" in item.path.parts:
            item.add_marker(pytest.mark.validation)
