"""What a campaign found of each fault, as a table of the docs."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

from hil.campaign.summary import Detection, Share
from hil.faults import CATALOGUE

NAMED = 3
"""Checks that are named for a fault."""
HEAD = (
    "# What a validation finds\n\n"
    "Made by `aero-hil learn`. Each fault of [the catalogue](faults.md) was put into homed, healthy hands of the\n"
    "population, one at a time. A cell has the severity and the hands on which a check failed or the run was stopped,\n"
    "of those on which it was tried.\n\n"
)


def detection_table(rows: Sequence[Detection], alarms: Share | None) -> str:
    """Return the table as Markdown.

    Args:
        rows: of all faults and severities.
        alarms: healthy hands that were accused, None when there were none.
    """
    by_name: dict[str, list[Detection]] = defaultdict(list)
    for row in rows:
        by_name[row.name].append(row)
    lines = [HEAD]
    if alarms is not None:
        lines.append(f"Healthy hands accused by the same limits: {alarms}, the bounds with a confidence of 95 %.\n\n")
    lines.append("| fault | tried and found | checks that found it most often |\n|---|---|---|\n")
    for name, some in by_name.items():
        kind = CATALOGUE[name]
        cells = ", ".join(_cell(row) for row in some)
        checks: dict[str, int] = defaultdict(int)
        for row in some:
            for check, count in row.checks:
                checks[check] += count
        named = ", ".join(f"`{check}`" for check, _ in sorted(checks.items(), key=lambda item: -item[1])[:NAMED])
        lines.append(f"| `{name}` | {cells} | {named or (kind.reason if not kind.visible else 'none')} |\n")
    return "".join(lines)


def _cell(row: Detection) -> str:
    found = f"{row.found.count} of {row.found.of}"
    return found if CATALOGUE[row.name].is_switch else f"{row.severity:g} {row.unit}: {found}"
