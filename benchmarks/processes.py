"""Whole processes: memory that does not grow, and start-up."""
# ruff: noqa: E501

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from benchmarks.pairs import Paired, paired

Row = tuple[str, str, str]

POSES = """
import sys, time, resource
import jax, jax.numpy as jnp, numpy as np
from trivet.kinematics.mode import parse_mode
from trivet.model import load
from trivet.space.pose import zyz_frame
from trivet.statics.stiffness import CHUNK, TILE, stream
count = int(float(sys.argv[1]))
machine = load("azulay"); signs = parse_mode(machine)
generator = np.random.default_rng(1)
shape = (CHUNK, TILE)
pool = [
    jax.tree.map(jnp.asarray, zyz_frame(generator.normal([0, 0, 0.123], [2e-3, 2e-3, 1e-3], (*shape, 3)), *generator.uniform(0, 1.5, (3, *shape))))
    for _ in range(8)
]
def batches():
    for k in range(-(-count // (CHUNK * TILE))):
        yield pool[k % len(pool)]
start = time.perf_counter()
total, done = 0.0, 0
for entries, reached in stream(machine, batches(), signs):
    total += float(np.sum(np.asarray(entries[0])[np.asarray(reached)])); done += reached.size
print(done, total / done, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024, time.perf_counter() - start)
"""


def constant_memory() -> Iterator[Row]:
    """Peak memory of a stream of full stiffnesses, against the number of poses."""
    for count in (1e6, 1e7, 1e8):
        done = subprocess.run([sys.executable, "-c", POSES, str(count)], capture_output=True, text=True, check=True)
        poses, _, peak, time = (float(v) for v in done.stdout.split())
        yield (
            f"stream of {count:.0e} poses, full 6×6, compilation timed too",
            f"peak {peak:.0f} MiB, {poses / time / 1e6:.1f} million poses/s",
            "constant memory",
        )


def whole_processes() -> Iterator[Row]:
    """Start-up and the main job as whole processes, the compilation cache warm."""
    with tempfile.TemporaryDirectory() as folder:
        figure = Path(folder, "c.png")
        quiet = {
            "stdout": subprocess.DEVNULL,
            "stderr": subprocess.DEVNULL,
            "check": True,
            "env": os.environ | {"COLUMNS": "200"},
        }

        def run(*arguments: str) -> None:
            subprocess.run([sys.executable, *arguments], **quiet)  # type: ignore[call-overload]

        found = paired(
            lambda: run("-m", "trivet", "compare", "--figure", str(figure), "--overwrite"),
            lambda: run("-c", "import jax"),
            pairs=15,
            calls=1,
        )
        inverse = Paired(found.peer, found.ours)
        median, low, high = inverse.ratio
        yield (
            "trivet compare with one figure, time over that of python -c 'import jax'",
            f"{median:.1f} ({low:.1f} to {high:.1f}); {np.median(found.ours):.1f} s",
            "≤ 10",
        )
        found = paired(lambda: run("-m", "trivet", "--help"), lambda: run("-c", "pass"), pairs=15, calls=1)
        low, median, high = np.quantile(found.ours, [0.25, 0.5, 0.75])
        yield "trivet --help", f"{median:.2f} s ({low:.2f} to {high:.2f})", "≤ 0.3 s"
