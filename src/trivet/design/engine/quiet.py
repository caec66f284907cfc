"""dask.distributed without its log: what matters of it is told by this package, in one line."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

LOGGERS = ("distributed", "tornado", "asyncio", "bokeh")
SILENT = {"DASK_LOGGING__DISTRIBUTED": "critical"}
"""Environment of worker processes."""


@contextmanager
def quiet() -> Iterator[None]:
    """No messages and no warnings of distributed while the block runs; nor after an error, of which threads may tell later."""
    import distributed
    from distributed.versions import VersionMismatchWarning

    del distributed  # its loggers are set up when it is imported
    known = list(logging.root.manager.loggerDict)
    loggers = [logging.getLogger(name) for name in known if name.split(".")[0] in LOGGERS]
    before = [(logger.handlers, logger.propagate) for logger in loggers]
    for logger in loggers:
        logger.handlers, logger.propagate = [logging.NullHandler()], False
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", VersionMismatchWarning)
        yield
    for logger, (handlers, propagate) in zip(loggers, before, strict=True):
        logger.handlers, logger.propagate = handlers, propagate
