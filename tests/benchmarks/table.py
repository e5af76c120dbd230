"""The table of `make bench`: what trajevo takes and what others take, each pair measured in turn in one run.

It is printed as Markdown, line by line as it is measured; `table.py NAME ...` measures only some of the parts. Times
are CPU times, medians and quartiles of the rounds; ratios are taken within each round.
"""

from __future__ import annotations

import argparse
import importlib.metadata
import os
import platform
from collections.abc import Callable, Iterator
from pathlib import Path

import rows_capacity
import rows_evaluation
import rows_fronts
import rows_kernels
import rows_runs
import rows_scaling
import rows_start
from cases import COLUMNS, Line

from trajevo.base.arrays import one_blas_thread

PARTS: dict[str, Callable[[], Iterator[Line]]] = {
    "kernels": rows_kernels.lines,
    "evaluation": rows_evaluation.lines,
    "runs": rows_runs.lines,
    "capacity": rows_capacity.lines,
    "fronts": rows_fronts.lines,
    "start": rows_start.lines,
    "scaling": rows_scaling.lines,
}

PACKAGES = ("trajevo", "numpy", "scipy", "pin", "pymoo", "moocore", "numba")
PEERS = ("pygmo", "toppra", "roboticstoolbox-python")


def versions(packages: tuple[str, ...]) -> Iterator[str]:
    """Names and versions, also of what is not installed."""
    for name in packages:
        try:
            yield f"{name} {importlib.metadata.version(name)}"
        except importlib.metadata.PackageNotFoundError:
            yield f"{name} not installed"


def processor() -> str:
    """Model of the processor."""
    file = Path("/proc/cpuinfo")
    names = [line for line in file.read_text().splitlines() if line.startswith("model name")] if file.exists() else []
    return names[0].partition(":")[2].strip() if names else platform.processor() or platform.machine()


def header() -> str:
    """What the table was measured on."""
    load = f"load {os.getloadavg()[0]:.2f} before" if hasattr(os, "getloadavg") else "load unknown"
    return "\n".join(
        [
            f"{processor()}, {os.cpu_count()} cores, {platform.system()} {platform.release()}, {load}; "
            f"{platform.python_implementation()} {platform.python_version()}; {', '.join(versions(PACKAGES))}; "
            f"{', '.join(versions(PEERS))}.",
            "",
            f"| {' | '.join(COLUMNS)} |",
            "|---" * len(COLUMNS) + "|",
        ]
    )


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", metavar="NAME", help=f"of {', '.join(PARTS)}; all if none is named")
    parts = parser.parse_args().parts or list(PARTS)
    if unknown := sorted(set(parts) - set(PARTS)):
        parser.error(f"no such part: {', '.join(unknown)}; there are {', '.join(PARTS)}")
    os.environ.setdefault("TRAJEVO_KERNELS", "compiled")  # where numba is installed, whatever is ready
    print(header(), flush=True)
    missed, above = 0, ""
    with one_blas_thread():
        for part in parts:
            for line in PARTS[part]():
                missed += "missed" in line.asked
                print(line._replace(measured="") if line.measured == above else line, flush=True)
                above = line.measured
    print(f"\nLines that miss what is asked for: {missed}.")


if __name__ == "__main__":
    main()
