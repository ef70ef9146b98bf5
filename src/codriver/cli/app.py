"""The application: commands, and what happens to errors.

Exit codes: 0 done, 1 the data does not allow it, 2 misuse, 130 interrupted, 143 terminated.
"""

from __future__ import annotations

import os
import signal
import sys
from types import FrameType
from typing import Annotated

import typer

from codriver import __version__
from codriver.cli import (
    check,
    demo,
    driver_horizon,
    estimate,
    export,
    identify_driver,
    info,
    plot,
    reproduce,
    simulate,
    smooth,
    style,
    tune,
)
from codriver.errors import CodriverError

app = typer.Typer(
    name="codriver",
    help="What the driver intends and does, estimated from the signals a vehicle already has.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # plain help: loading rich for it would double the start
    context_settings={"help_option_names": ["-h", "--help"]},
)
app.command("demo")(demo.demo)
app.command("info")(info.info)
app.command("estimate")(estimate.estimate)
app.command("smooth")(smooth.smooth)
app.add_typer(identify_driver.app, name="identify")
app.command("tune")(tune.tune)
app.command("style")(style.style)
app.add_typer(driver_horizon.app, name="driver")
app.add_typer(check.app, name="check")
app.add_typer(plot.app, name="plot")
app.add_typer(simulate.app, name="simulate")
app.command("reproduce")(reproduce.reproduce)
app.add_typer(export.app, name="export")


def _version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"codriver {__version__}")
        raise typer.Exit


@app.callback()
def _root(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Show the version and exit.")
    ] = False,
) -> None:
    """What the driver intends and does, estimated from the signals a vehicle already has."""


def main() -> None:
    """Run the command line; errors of the data become a message and an exit code, never a traceback."""
    # `kill` ends a program before it can clear up, and typer swallows Ctrl-C; as an exception of our own both pass all
    # the clearing up and reach us.
    before = {number: signal.signal(number, _end) for number in (signal.SIGINT, signal.SIGTERM)}
    try:
        _run()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


class _Ended(BaseException):
    """The program was told to end by a signal of this number."""


def _end(number: int, frame: FrameType | None) -> None:
    raise _Ended(number)


def _run() -> None:
    """The application, its errors turned into messages and exit codes."""
    try:
        app(prog_name="codriver")
    except CodriverError as error:
        typer.secho(
            f"codriver: {_printable(str(error))}", err=True, fg=typer.colors.RED if sys.stderr.isatty() else None
        )
        raise SystemExit(error.exit_code) from None
    except _Ended as end:
        number = int(end.args[0])
        said = "interrupted" if number == signal.SIGINT else "terminated"
        typer.echo(f"codriver: {said}; no result was written", err=True)
        raise SystemExit(128 + number) from None
    except BrokenPipeError:
        raise SystemExit(0) from None
    except MemoryError:
        typer.echo("codriver: out of memory; estimate a shorter part of the log", err=True)
        raise SystemExit(1) from None
    except OSError as error:
        typer.echo(f"codriver: {error.strerror or error}: {error.filename or ''}", err=True)
        raise SystemExit(1) from None
    except Exception as error:
        if os.environ.get("CODRIVER_DEBUG"):
            raise
        typer.echo(
            f"codriver: this should not have happened: {type(error).__name__}: {error}\n"
            "  nothing was written; set CODRIVER_DEBUG=1 to see where, and please report it with the log's format",
            err=True,
        )
        raise SystemExit(1) from None


def _printable(text: str) -> str:
    """Text whose control characters cannot disturb a terminal: damaged files are quoted in messages."""
    return "".join(c if c.isprintable() or c == "\n" else "?" for c in text)
