"""`aero-hil map`: convert a posture by hand."""

from __future__ import annotations

import json
from typing import Any, TextIO

import click
import numpy as np

from aero.actuation import CALIBRATIONS, ActuationMap
from aero.actuation.representations import REPRESENTATIONS, Representation, convert
from aero.firmware import DEFAULT_FIRMWARE, FIRMWARE
from hil.cli.exits import usage_errors

MOST_CHARACTERS = 2**20
"""Longest posture that is read; one has some hundred characters."""
_SOURCES = [name for name, representation in REPRESENTATIONS.items() if representation.to_travel is not None]


@click.command("map")
@click.option("--from", "source", required=True, type=click.Choice(_SOURCES), help="What the input is.")
@click.option("--to", "target", required=True, type=click.Choice(list(REPRESENTATIONS)), help="What is wanted.")
@click.option("--firmware", default=DEFAULT_FIRMWARE, show_default=True, type=click.Choice(list(FIRMWARE)))
@click.option(
    "--calibration", type=click.Choice(list(CALIBRATIONS)), help="State of firmware 0.2.0; homed if not given."
)
@click.option("--hand", default="right", show_default=True, type=click.Choice(["right", "left"]))
@click.option("--coefficients", default="paper", show_default=True, help="paper, identified, or a TOML file.")
@click.option("--saturate", is_flag=True, help="Bring what lies outside the command window to its ends.")
@click.argument("posture", type=click.File("r"), default="-")
def map_command(
    *,
    source: str,
    target: str,
    firmware: str,
    calibration: str | None,
    hand: str,
    coefficients: str,
    saturate: bool,
    posture: TextIO,
) -> None:
    """Convert the POSTURE in a JSON file (standard input if not given) between two representations.

    The input is a list of numbers, an object of numbers by name, or what this command printed before; the output says
    names, units and which map was used. Angles are in degrees and travel in mm; lengths are the simulator's m and rad.

    \b
    echo '[30, 30, 30, 30, 45, 20, 10]' | aero-hil map --from compact --to codes
    """  # noqa: D301 - the backspace tells Click to keep the paragraph as it is
    with usage_errors():
        codec = ActuationMap.for_firmware(firmware, calibration, hand=hand, coefficients=coefficients)
        values = _read(posture, source)
        result = convert(codec, values, source, target, saturate=saturate)
    representation = REPRESENTATIONS[target]
    names = REPRESENTATIONS["codes"].labels
    click.echo(
        json.dumps(
            {
                "representation": target,
                "values": _named(representation, result.values),
                "units": dict(zip(representation.labels, representation.units, strict=True)),
                "saturated": [name for name, hit in zip(names, result.saturated, strict=True) if hit],
                "map": codec.describe(),
            },
            indent=2,
            ensure_ascii=False,
        )
    )


def _read(posture: TextIO, source: str) -> list[float]:
    """Return the values of a posture in the order of its representation.

    Raises:
        ValueError: no JSON, another representation, or names that are missing or unknown.
    """
    try:
        text = posture.read(MOST_CHARACTERS + 1)
        if len(text) > MOST_CHARACTERS:
            raise ValueError(f"it has more than {MOST_CHARACTERS} characters")
        data: Any = json.loads(text)
    except (OSError, ValueError, RecursionError) as error:
        raise ValueError(f"{posture.name} is not a posture in JSON: {error}") from error
    if isinstance(data, dict) and "representation" in data:
        if data["representation"] != source:
            raise ValueError(f"the input has representation {data['representation']!r}, expected {source!r}")
        data = data["values"]
    labels = REPRESENTATIONS[source].labels
    if isinstance(data, dict):
        if set(data) != set(labels):
            raise ValueError(f"{source}: expected the names {', '.join(labels)}; got {', '.join(data)}")
        data = [data[label] for label in labels]
    if not isinstance(data, list) or not all(isinstance(x, int | float) and not isinstance(x, bool) for x in data):
        raise ValueError(f"{source}: expected {len(labels)} numbers, or an object with them by name")
    return data


def _named(representation: Representation, values: np.ndarray) -> dict[str, float]:
    whole = set(representation.units) <= {"1/65535", "count"}
    return {
        label: int(value) if whole else float(f"{value + 0.0:.9g}")
        for label, value in zip(representation.labels, values.tolist(), strict=True)
    }
