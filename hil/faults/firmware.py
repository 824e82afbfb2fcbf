"""Faults of which firmware a board runs: it is built with it, until another is flashed."""

from __future__ import annotations

from aero.firmware import FIRMWARE
from firmware_emulator.firmware.hands import HandSide
from hil.faults.active import Active
from hil.faults.assembly import HandAssembly
from hil.faults.fault import Fault, FaultLayer, Inject, Injection
from hil.faults.part import Part

RUNS = "board_runs_"
"""Begins the name of a fault that says which version the board runs in truth."""
OTHER_SIDE: dict[HandSide, HandSide] = {"right": "left", "left": "right"}


def _runs(version: str) -> Inject:
    def inject(assembly: HandAssembly, fault: Injection) -> Active:
        declared = assembly.firmware
        if version == declared:
            raise ValueError(f"a board that runs {version} as declared is no fault; declare another firmware")
        return Active(lambda: setattr(assembly, "firmware", version), lambda: assembly.flash(declared, assembly.side))

    return inject


def _wrong_side(assembly: HandAssembly, fault: Injection) -> Active:
    return Active(
        lambda: setattr(assembly, "board_side", OTHER_SIDE[assembly.side]),
        lambda: assembly.flash(assembly.firmware, assembly.side),
    )


FAULTS = (
    # The firmware or the name that was given for it: whoever flashes and whoever names mend the same.
    *(
        Fault(
            f"{RUNS}{version}",
            FaultLayer.FIRMWARE,
            Part.SETUP,
            f"the board runs {version}, another version than declared",
            _runs(version),
            later=False,
            excludes="version",
            alike=(Part.BOARD,),
        )
        for version in FIRMWARE
    ),
    Fault(
        "board_of_other_side",
        FaultLayer.FIRMWARE,
        Part.SETUP,
        "the firmware is that of the other hand",
        _wrong_side,
        later=False,
        alike=(Part.BOARD,),
    ),
)
