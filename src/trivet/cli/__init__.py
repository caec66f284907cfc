"""The command `trivet`.  Nothing heavy is imported before a command needs it."""

from __future__ import annotations

import contextlib
import io
import os
import signal
import sys
from types import FrameType

from trivet.files import remove_begun

INTERRUPTED = 130


def program() -> None:
    """`main` as a process of its own.

    Whoever interrupts it may do so while a kernel is at work in a thread: it leaves without clearing anything away under that.
    """
    try:
        main()
    except SystemExit as leaving:
        code = int(leaving.code or 0)
        if code > 128:
            for stream in (sys.stdout, sys.stderr):
                with contextlib.suppress(AttributeError, OSError, ValueError):
                    stream.flush()
            os._exit(code)
        raise


def main() -> None:
    """Run a command; errors become one line and an exit code (2 wrong input, 1 no result, 130 interrupted, 143 ended
    by SIGTERM)."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):  # end as by an exception, so that half-written files are cleared away
        if hasattr(signal, name) and signal.getsignal(getattr(signal, name)) != signal.SIG_IGN:
            signal.signal(getattr(signal, name), _leave)
    _open_streams()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a terminal or a pipe that cannot show "×" gets "?"
    try:
        code = _run()
        if sys.stdout is not None:
            sys.stdout.flush()
    except KeyboardInterrupt:
        print("trivet: interrupted", file=sys.stderr)
        code = INTERRUPTED
    except OSError as error:
        # Output that nobody takes (a closed pipe) or that has no room; the interpreter must not trip over it once more.
        if sys.stdout is not None:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        code = 0 if isinstance(error, BrokenPipeError) else 1
        if code:
            print(f"trivet: the output cannot be written: {error.strerror}", file=sys.stderr)
    except SystemExit as leaving:
        # typer and rich leave with 1 where they meet a closed pipe.
        code = 0 if isinstance(leaving.__context__, BrokenPipeError) else int(leaving.code or 0)
    finally:
        if hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, 0)  # whoever is leaving has got here
    # All is written; what the interpreter still clears away is not to be interrupted.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    sys.exit(code)


def _open_streams() -> None:
    """Have the null device stand for streams that are closed: else a file of results takes their number, and messages."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)  # takes the least number that is free
    if sys.stderr is None:  # what is printed to no stream would go to the standard output
        sys.stderr = io.TextIOWrapper(io.FileIO(2, "w", closefd=False), encoding="utf-8")


def _leave(number: int, frame: FrameType | None) -> None:
    code = INTERRUPTED if number == signal.SIGINT else 128 + number
    if _is_importing(frame):
        # An exception in the middle of a library that sets itself up can end in a crash.
        remove_begun()
        with contextlib.suppress(OSError, ValueError):
            os.write(2, b"\r\x1b[2K" * os.isatty(2) + b"trivet: interrupted\n")  # over the sign of life
        os._exit(code)
    # Raised within a callback of the garbage collector an exception is lost, but for a message; the alarm raises it again.
    sys.unraisablehook = _quiet_about_leaving
    if hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, lambda *_: _leave(number, None))
        signal.setitimer(signal.ITIMER_REAL, 0.05)
    raise KeyboardInterrupt if number == signal.SIGINT else SystemExit(code)


def _is_importing(frame: FrameType | None) -> bool:
    while frame is not None:
        if frame.f_code.co_filename.startswith("<frozen importlib"):
            return True
        frame = frame.f_back
    return False


def _quiet_about_leaving(unraisable: sys.UnraisableHookArgs) -> None:
    if not isinstance(unraisable.exc_value, (KeyboardInterrupt, SystemExit)):
        sys.__unraisablehook__(unraisable)


def _run() -> int:
    import typer

    from trivet.cli.app import app
    from trivet.errors import TrivetError

    _keep_compiled_kernels()
    # Matrices are small here: threads inside LAPACK cost more than they bring.  To be said before NumPy is imported.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        # Commands return nothing; what comes back is the code with which typer would have left.
        code = int(app(standalone_mode=False) or 0)
    except typer.Abort:
        raise KeyboardInterrupt from None
    except TrivetError as error:
        print(f"trivet: {error}", file=sys.stderr)
        return error.exit_code
    except Exception as error:
        # Wrong usage; typer may carry its own copy of click, whose errors share no public class with click's.
        message = getattr(error, "format_message", None)
        if message is None:
            raise
        print(f"trivet: {message()} (see trivet --help)", file=sys.stderr)
        return 2
    if code == INTERRUPTED:
        raise KeyboardInterrupt
    return code


def _keep_compiled_kernels() -> None:
    """Have JAX keep compiled kernels between runs; its own variables take precedence."""
    from platformdirs import user_cache_dir

    os.environ.setdefault("JAX_COMPILATION_CACHE_DIR", os.path.join(user_cache_dir("trivet", False), "kernels"))
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS", "0")
    os.environ.setdefault("JAX_PERSISTENT_CACHE_MIN_ENTRY_SIZE_BYTES", "-1")
