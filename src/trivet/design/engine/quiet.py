"""dask.distributed without its log: what matters of it is told by this package, in one line."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager

LOGGERS = ("distributed", "tornado", "asyncio", "bokeh")
SILENT = {"DASK_LOGGING__DISTRIBUTED": "critical"}
"""Environment of worker processes."""


@contextmanager
def quiet() -> Iterator[None]:
    """No messages and no warnings of distributed while the block runs."""
    import distributed
    from distributed.versions import VersionMismatchWarning

    del distributed  # its loggers are set up when it is imported
    with ExitStack() as stack:
        stack.enter_context(warnings.catch_warnings())
        warnings.simplefilter("ignore", VersionMismatchWarning)
        for name in LOGGERS:
            logger = logging.getLogger(name)
            stack.callback(setattr, logger, "handlers", logger.handlers)
            stack.callback(setattr, logger, "propagate", logger.propagate)
            logger.handlers, logger.propagate = [logging.NullHandler()], False
        yield
