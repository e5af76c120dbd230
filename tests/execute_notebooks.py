"""Execute every notebook into build/notebooks: `make notebooks` (full size when TRAJEVO_FULL=1)."""

from pathlib import Path

import jupytext
import nbformat
from nbclient import NotebookClient

HERE = Path(__file__).parent


def execute(source: Path, target: Path) -> None:
    """Run a py:percent notebook and write it with its outputs."""
    notebook = jupytext.read(source)
    NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(HERE)}}).execute()
    target.parent.mkdir(parents=True, exist_ok=True)
    nbformat.write(notebook, target)


if __name__ == "__main__":
    for file in sorted(HERE.glob("[0-9]*.py")):
        output = HERE.parent / "build" / "notebooks" / f"{file.stem}.ipynb"
        execute(file, output)
        print(f"written: {output.relative_to(HERE.parent)}")
