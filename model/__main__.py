"""`python -m model export` writes a hand as MJCF, `python -m model render` draws it."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from aero.whole_file import write_whole
from model.built import build_built
from model.routed import build_routed

BUILDERS = {"routed": build_routed, "built": build_built}


def main(arguments: Sequence[str] | None = None) -> None:
    """Run one command; see `python -m model --help`."""
    parser = argparse.ArgumentParser(prog="python -m model", description=__doc__)
    commands = parser.add_subparsers(dest="action", required=True)
    for action, help_text in (("export", "write MJCF"), ("render", "write a PNG of the hand")):
        command = commands.add_parser(action, help=help_text)
        command.add_argument("--hand", choices=("right", "left"), default="right")
        command.add_argument("--kind", choices=tuple(BUILDERS), default="routed")
        command.add_argument("--out", type=Path, required=True, metavar="PATH")
    options = parser.parse_args(arguments)
    spec = BUILDERS[options.kind](options.hand)
    if options.action == "export":
        spec.compile()
        write_whole(options.out, spec.to_xml())
    else:
        # Imported late: drawing needs an OpenGL context, exporting does not.
        from model.pictures import write_picture  # noqa: PLC0415

        write_picture(spec, options.out, options.hand)
    print(f"{options.out}: {options.kind} {options.hand} hand")


if __name__ == "__main__":
    main()
