"""``python -m trajevo`` is the command ``trajevo``."""

from trajevo.cli.main import main

main()
