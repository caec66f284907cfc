"""What all tests share: engines that nobody here wrote (peers), and one thread per linear algebra call."""

from __future__ import annotations

import importlib
import os

# The systems are small: threads inside LAPACK cost more than they bring.  To be set before NumPy is imported.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import hypothesis
import pytest

# A first call compiles, and machines are shared: slow is no fault.
hypothesis.settings.register_profile("trivet", deadline=None)
hypothesis.settings.load_profile("trivet")


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line(
        "markers",
        "peer(name, module=name): compares with an engine that nobody here wrote; skipped where it is missing, "
        "failed with TRIVET_PEERS=required",
    )


def pytest_runtest_setup(item: pytest.Item) -> None:
    for mark in item.iter_markers("peer"):
        name = mark.args[0]
        try:
            importlib.import_module(mark.kwargs.get("module", name))
        except Exception as error:  # a wheel whose system library is missing raises more than ImportError
            reason = f"peer {name} is missing ({error})"
            if os.environ.get("TRIVET_PEERS") == "required":
                pytest.fail(reason + "; TRIVET_PEERS=required", pytrace=False)
            pytest.skip(reason)
