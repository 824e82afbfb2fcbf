from aero.channels import Channel
from hil.verdict.part import Part
from hil.verdict.parts import Suspect


def test_a_suspect_is_named_with_its_channel() -> None:
    assert str(Suspect(Part.SERVO, Channel.RING)) == "servo of the ring finger"
    assert str(Suspect(Part.USB)) == "USB cable and hub"
