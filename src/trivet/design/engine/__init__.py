"""Chunks of a study worked out in this process, by processes beside it or by a cluster, one way for all (dask.distributed).

Work is sent as numbers of chunks.  What is found comes back to this process, which alone writes it.
"""

from trivet.design.engine.running import Outcome, run
from trivet.design.engine.task import Task

__all__ = ["Outcome", "Task", "run"]
