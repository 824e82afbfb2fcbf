"""Tables of docs/detection.md, from what a campaign found."""

from __future__ import annotations

from figures.cells import Cell
from figures.sources import Cost, Row, Source
from figures.stored import STORED, folder
from hil.faults import CATALOGUE
from hil.lab.campaign.detected_faults import DetectedFault, parse_detected
from hil.lab.campaign.summary import Share

FILE = "detected_faults.json"


def _found() -> tuple[tuple[DetectedFault, ...], Share | None]:
    return parse_detected((folder() / FILE).read_text(encoding="utf-8"))


def faults() -> list[Row]:
    """Each fault of the catalogue: from which severity on it is found, and by which checks."""
    header = ("fault", "found from", "tried and found", "checks that found it most often, and what hides it")
    return [header, *(_row(fault) for fault in _found()[0])]


def healthy() -> list[Row]:
    """Healthy hands that the same limits accuse."""
    alarms = _found()[1]
    assert alarms is not None, "the campaign had no healthy hands"
    low, high = (100.0 * bound for bound in alarms.interval)
    return [
        ("healthy hands", "accused", "share, 95 %"),
        (str(alarms.of), str(alarms.count), Cell.of("{:.1f} % to {:.1f} %", low, high)),
    ]


def _row(fault: DetectedFault) -> Row:
    kind = CATALOGUE[fault.name]
    cells = []
    for tried in fault.tried:
        found = f"{tried.found} of {tried.of}" + (f" ({tried.furthest:.1f})" if tried.found < tried.of else "")
        cells.append(found if kind.is_switch else f"{tried.severity:g} {kind.unit}: {found}")
    words = "; ".join(part for part in (", ".join(f"`{check}`" for check in fault.checks), kind.reason) if part)
    return (f"`{fault.name}`", _found_from(fault), ", ".join(cells), words)


def _found_from(fault: DetectedFault) -> str:
    if fault.found_from is None:
        return "not on every hand" if any(tried.found for tried in fault.tried) else "never"
    return "always" if CATALOGUE[fault.name].is_switch else f"{fault.found_from:g}"


COMMAND = "`aero-hil learn CAMPAIGN --out hil/data --detected docs/figures/stored/detected_faults.json`"
ORIGIN = "[campaigns](campaign.md) has the seeds and commits of CAMPAIGN"
TABLES = {
    "healthy": Source(healthy, COMMAND, STORED, Cost.STORED, ORIGIN),
    "faults": Source(faults, COMMAND, STORED, Cost.STORED, ORIGIN),
}
