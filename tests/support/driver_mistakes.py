"""Mutations of the driver and the map, each applied by pytest's `MonkeyPatch`."""

import dataclasses
from collections.abc import Callable, Sequence

import numpy as np
import pytest

from aero import protocol
from aero.actuation import ActuationMap, load_coefficients
from aero.driver import AeroHand
from hil.emulated.any_hand import open_target
from hil.verdict.part import Part
from hil.verdict.parts import Suspect
from hil.verdict.validation import validate

GENTLE = ("presence", "audit")
MAPPED = ("presence", "replay")
"""Experiments for mutations; the second is the shortest one that uses the map."""


def order(monkeypatch):
    real = protocol._to_wire
    monkeypatch.setattr(protocol, "_to_wire", lambda row: real([row[1], row[0], *row[2:]]))


def order_both_ways(monkeypatch):
    """Exchange index and middle in both directions, which the readings of similar fingers cannot reveal."""
    order(monkeypatch)
    real = protocol._from_wire
    monkeypatch.setattr(protocol, "_from_wire", lambda words: [real(words)[i] for i in (1, 0, 2, 3, 4, 5, 6)])


def wrapped(name, change):
    """Mutation of an argument of a driver's method."""

    def put_in(monkeypatch):
        real = getattr(AeroHand, name)
        monkeypatch.setattr(AeroHand, name, lambda self, codes: real(self, change(np.asarray(codes, np.int64))))

    return put_in


def returned(name, change):
    """Mutation of the result of a driver's method."""

    def put_in(monkeypatch):
        real = getattr(AeroHand, name)
        monkeypatch.setattr(AeroHand, name, lambda self: change(real(self)))

    return put_in


def one_late(monkeypatch):
    real, before = AeroHand.command_codes, [np.zeros(7, np.int64)]

    def late(self, codes):
        before.append(np.asarray(codes, np.int64))
        real(self, before[-2])

    monkeypatch.setattr(AeroHand, "command_codes", late)


def every_third_left_out(monkeypatch):
    real, count = AeroHand.command_codes, [0]

    def lazy(self, codes):
        count[0] += 1
        if count[0] % 3:
            real(self, codes)

    monkeypatch.setattr(AeroHand, "command_codes", lazy)


def one_old(monkeypatch):
    real, last = AeroHand.read_codes, [np.zeros(7, np.uint16)]

    def old(self):
        last.append(real(self))
        return last[-2]

    monkeypatch.setattr(AeroHand, "read_codes", old)


def each_twice(monkeypatch):
    real = AeroHand.command_codes

    def twice(self, codes):
        real(self, codes)
        real(self, codes)

    monkeypatch.setattr(AeroHand, "command_codes", twice)


def half_the_speed(monkeypatch):
    real = AeroHand.set_speed
    monkeypatch.setattr(AeroHand, "set_speed", lambda self, channel, speed: real(self, channel, int(speed) // 2))


def coefficient(name, change):
    """Mutation of one coefficient of the map, under the paper's name."""

    def put_in(monkeypatch):
        paper = load_coefficients("paper")
        wrong = dataclasses.replace(paper, **{name: change(getattr(paper, name))})
        real = ActuationMap.for_firmware.__func__
        monkeypatch.setattr(
            ActuationMap,
            "for_firmware",
            classmethod(lambda cls, *args, **named: dataclasses.replace(real(cls, *args, **named), coefficients=wrong)),
        )

    return put_in


def window(monkeypatch):
    real = ActuationMap.for_firmware.__func__
    monkeypatch.setattr(
        ActuationMap,
        "for_firmware",
        classmethod(
            lambda cls, version, calibration=None, **named: dataclasses.replace(
                real(cls, version, calibration, **named),
                window=dataclasses.replace(
                    real(cls, "0.1.5", None, **named).window, name=real(cls, version, calibration, **named).window.name
                ),
            )
        ),
    )


def without_abduction(rows):
    return tuple((0.0, *row[1:]) for row in rows)


MISTAKES = {
    "sends index and middle exchanged": order,
    "exchanges index and middle out and back": order_both_ways,
    "sends half": wrapped("command_codes", lambda codes: codes // 2),
    "sends 2 % more": wrapped("command_codes", lambda codes: np.minimum(codes * 51 // 50, 65535)),
    "sends even codes only": wrapped("command_codes", lambda codes: codes // 2 * 2),
    "sends the thumb reversed": wrapped(
        "command_codes", lambda codes: np.where(np.arange(7) == 5, 65535 - codes, codes)
    ),
    "sends eight bits": wrapped("command_codes", lambda codes: codes & 0xFF00),
    "rounds down to eight bits": wrapped("command_codes", lambda codes: codes // 256 * 256),
    "sends one command late": one_late,
    "sends each command twice": each_twice,
    "sets half the speed": half_the_speed,
    "leaves every third command out": every_third_left_out,
    "reads one reply late": one_old,
    "reads 1 % less": returned("read_codes", lambda codes: (codes * 0.99).astype(np.uint16)),
    "reads currents without their sign": returned("read_currents", np.abs),
    "reads currents with the other sign": returned("read_currents", lambda currents: -currents),
    "reads currents of 5 mA": returned("read_currents", lambda currents: currents * 5 / 6.5),
    "reads index and ring exchanged": returned("read_codes", lambda codes: codes[[2, 1, 0, 3, 4, 5, 6]]),
    "reads temperatures one short": returned("read_temperatures", lambda values: values - 1),
}
MISTAKES_OF_THE_MAP = {
    "has a spool of 9.1 mm": coefficient("spool_radius", lambda radius: 9.1e-3),
    "leaves the abduction out of the thumb's cables": coefficient("thumb_winding", without_abduction),
    "takes 0.1.5 for 0.2.0": window,
    "has another gain of the flexor": coefficient("thumb_gain", lambda gain: (gain[0], 1.02 * gain[1])),
}


def named_driver(mistake: Callable[[pytest.MonkeyPatch], None], experiments: Sequence[str]) -> bool:
    """Return whether the verdict on a healthy hand attributes a mutation to the driver or its map."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        mistake(monkeypatch)
        with open_target(unit="plausible:331007", seed=331007) as target:
            done = validate(target, experiments)
    return done.diagnosis.suspects == (Suspect(Part.DRIVER),)
