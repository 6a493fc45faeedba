"""Bootstrap of the test suite: no display, no threads from other libraries."""

import os
import signal
from pathlib import Path

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


_FAILED: dict[str, bool] = {}


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Remember, case by case, whether a long test failed."""
    folders = Path(report.nodeid.split("::")[0]).parts
    if folders[:2] == ("tests", "validation") and len(folders) == 4:
        _FAILED[folders[2]] = _FAILED.get(folders[2], False) or report.failed


def pytest_sessionfinish() -> None:
    """Put the verdict beside the numbers."""
    if _FAILED:
        from tests.validation import record

        for case, failed in _FAILED.items():
            record.judge(case, not failed)
