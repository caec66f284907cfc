"""Work for the engine that takes no time, in a module that worker processes can import."""

from __future__ import annotations

import os
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from trivet.design.engine import run
from trivet.design.engine.task import Work
from trivet.design.store import Chunk, Column, Layout, open_store

COLUMNS = (Column("x", "m", "a variable"), Column("f", "N/m", "a quantity"))


@dataclass(frozen=True)
class Cheap:
    """Sines of random numbers."""

    layout: Layout
    wait: float = 0.0
    """Seconds for each chunk."""
    fails: tuple[int, ...] = ()
    kills: tuple[int, ...] = ()
    """Chunks that kill their process."""
    once: str = ""
    """A file that is made when a chunk fails or kills; none does any more when it is there."""

    def prepared(self) -> Work:
        def work(k: int) -> Chunk:
            start, stop = self.layout.designs(k)
            time.sleep(self.wait)
            if k in self.fails + self.kills and not (self.once and Path(self.once).exists()):
                if self.once:
                    Path(self.once).touch()
                if k in self.fails:
                    raise ArithmeticError(f"chunk {k} will not do\nand more")
                os.kill(os.getpid(), signal.SIGKILL)
            x = np.random.default_rng(k).random(stop - start)
            return Chunk(np.stack([x, np.sin(7 * x)]), np.where(x < 0.5, 1, 2))

        return work


def layout(chunks: int = 12, chunk: int = 50) -> Layout:
    return Layout(COLUMNS, chunks * chunk - chunk // 3, chunk, {"study": "cheap"}, ("done", "not reached"))


def main() -> None:
    """Run a study: folder, chunks, seconds for each, processes, and the address of a scheduler."""
    folder, chunks, wait, workers = sys.argv[1], int(sys.argv[2]), float(sys.argv[3]), int(sys.argv[4])
    scheduler = sys.argv[5] if len(sys.argv) > 5 else None
    own = layout(chunks)
    with open_store(folder, own) as store:
        outcome = run(store, Cheap(own, wait), workers=workers, scheduler=scheduler, progress=tell, patience=20)
    print(outcome.done, outcome.total, len(outcome.failures), [str(fault) for fault in outcome.mended], flush=True)


def tell(done: int, total: int, remaining: float | None) -> None:
    print(done, total, remaining, flush=True)


if __name__ == "__main__":
    import cheap_designs  # as workers know it

    from trivet.errors import TrivetError

    # A shell that runs the tests in the background has its children ignore the signal.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        cheap_designs.main()
    except TrivetError as error:
        print(f"trivet: {error}", file=sys.stderr)
        sys.exit(error.exit_code)
