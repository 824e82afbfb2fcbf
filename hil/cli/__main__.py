"""Run the command line as `python -m hil.cli`, without the installed script."""

from hil.cli import main

main()
