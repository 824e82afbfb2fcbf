"""`python -m hil.cli`, the command line where the script is not installed."""

from hil.cli import main

main()
