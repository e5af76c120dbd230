"""``trajevo check-proof``: a proof file checked by the program that knows nothing of trajevo."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Annotated

import typer

from trajevo.base.files import read_bytes, why_not
from trajevo.cli.console import Terminal
from trajevo.errors import InvalidInputError, no_such_file
from trajevo.verification.check_proof import BadFileError, check

_out = Terminal()

#: How the checking program, which is kept short, begins what Python says of content that is no JSON.
_NO_JSON = re.compile(r"^(JSONDecodeError|UnicodeDecodeError): ")

#: How verdicts are told.
_TOLD = {True: "proven", False: "NOT PROVEN", None: "not checked"}


def check_proof(
    file: Annotated[Path, typer.Argument(help="File that `trajevo certify RUN --proof FILE` wrote.")],
) -> None:
    """Check a proof file without trusting what wrote it; exit code 1 if something that it claims is not proven."""
    if not print_proof(_out, file):
        raise typer.Exit(1)


def print_proof(out: Terminal, file: Path) -> bool:
    """Print what is proven of a proof file, and tell whether everything is that it claims.

    Raises:
        InvalidInputError: it is no proof file, contradicts itself, or cannot be read.
    """
    if not file.exists():
        raise InvalidInputError(no_such_file(file, "proof file"))
    try:
        rows = check(read_bytes(file))
    except BadFileError as error:
        said = _NO_JSON.sub("cannot be read as JSON: ", str(error))
        raise InvalidInputError(f"{file}: not a valid proof file: {said}") from error
    except OSError as error:
        raise InvalidInputError(f"{file}: cannot be read: {why_not(error)}") from error
    for name, proven, why in rows:
        out.print(f"{_TOLD[proven]}: {name}: {why}")
    count = {verdict: sum(proven is verdict for _, proven, _ in rows) for verdict in _TOLD}
    claims = count[True] + count[False]
    done = claims > 0 and not count[False]
    out.print(f"{_TOLD[done].upper()}: {count[True]} of {claims} claims; {count[None]} not checked")
    return done
