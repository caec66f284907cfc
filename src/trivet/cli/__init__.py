"""The command `trivet`.  Nothing heavy is imported before a command needs it."""

from __future__ import annotations

import os
import sys

INTERRUPTED = 130


def main() -> None:
    """Run a command; errors become one line and an exit code (2 wrong input, 1 no result, 130 interrupted)."""
    try:
        code = _run()
        sys.stdout.flush()
    except KeyboardInterrupt:
        print("trivet: interrupted", file=sys.stderr)
        code = INTERRUPTED
    except BrokenPipeError:
        # The reader of our output went away (`trivet list | head -1`); the interpreter must not trip over it once more.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0
    sys.exit(code)


def _run() -> int:
    import click

    from trivet.cli.app import app
    from trivet.errors import TrivetError

    _keep_compiled_kernels()
    try:
        app(standalone_mode=False)
    except TrivetError as error:
        print(f"trivet: {error}", file=sys.stderr)
        return error.exit_code
    except click.exceptions.Exit as stop:
        return stop.exit_code
    except click.exceptions.Abort:
        raise KeyboardInterrupt from None
    except click.ClickException as error:
        print(f"trivet: {error.format_message()}", file=sys.stderr)
        return 2
    return 0


def _keep_compiled_kernels() -> None:
    """Have JAX keep compiled kernels between runs; its own variables take precedence."""
    from platformdirs import user_cache_dir

    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", os.path.join(user_cache_dir("trivet", False), "kernels"))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "-1")
