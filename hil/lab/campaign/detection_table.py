"""What a campaign found of each fault, as a table of the docs."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence

from hil.faults import CATALOGUE
from hil.lab.campaign.summary import Detection, Share

NAMED = 3
"""Checks that are named for a fault."""
HEAD = (
    "# What a validation finds\n\n"
    "Made by `aero-hil learn`. Each fault of [the catalogue](faults.md) was put into homed, healthy hands of the\n"
    "population, one at a time. A cell has the severity and the hands on which a check failed or the run was stopped,\n"
    "of those on which it was tried. Where a hand was missed, the number in brackets says how far its readings went:\n"
    "0 is among those of healthy hands, 1 the limit. A fault is stated to be found from the severity on from which it\n"
    "was found on every hand.\n\n"
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
    lines.append("| fault | found from | tried and found | checks that found it most often, and what hides it |\n")
    lines.append("|---|---|---|---|\n")
    for name, some in by_name.items():
        cells = ", ".join(_cell(row) for row in some)
        checks: dict[str, int] = defaultdict(int)
        for row in some:
            for check, count in row.checks:
                checks[check] += count
        named = [f"`{check}`" for check, _ in sorted(checks.items(), key=lambda item: (-item[1], item[0]))[:NAMED]]
        words = "; ".join(part for part in (", ".join(named), CATALOGUE[name].reason) if part)
        lines.append(f"| `{name}` | {_found_from(some)} | {cells} | {words} |\n")
    return "".join(lines)


def found_from(rows: Sequence[Detection]) -> float | None:
    """Return the severity from which on a fault was found on every hand, None when there is none.

    Args:
        rows: of one fault, from mild to severe.
    """
    found = None
    for row in reversed(rows):
        if row.found.count < row.found.of:
            break
        found = row.severity
    return found


def _found_from(rows: Sequence[Detection]) -> str:
    severity = found_from(rows)
    if severity is None:
        return "never" if not any(row.found.count for row in rows) else "not on every hand"
    return "always" if CATALOGUE[rows[0].name].is_switch else f"{severity:g}"


def _cell(row: Detection) -> str:
    found = f"{row.found.count} of {row.found.of}"
    if row.found.count < row.found.of:
        found += f" ({row.furthest:.1f})"
    return found if CATALOGUE[row.name].is_switch else f"{row.severity:g} {row.unit}: {found}"
