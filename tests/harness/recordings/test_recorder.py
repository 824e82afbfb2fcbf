"""Everything in a recording counts from its beginning, on the target's clock."""

import numpy as np
import pytest

from hil import open_target
from hil.recordings.recorder import Recorder


def test_samples_events_and_bytes_have_the_time_since_the_beginning():
    """It begins 2 s after the opening; a note comes 0.5 s later, a reading 0.25 s after that."""
    with open_target() as target:
        target.clock.sleep_until(target.clock.now() + 2.0)
        recorder = Recorder(target, "presence")
        recorder.begin()
        target.clock.sleep_until(recorder.start + 0.5)
        recorder.note("half a second")
        target.clock.sleep_until(recorder.start + 0.75)
        recorder.add("codes", target.clock.now(), target.hand.read_codes())
        recording = recorder.finish()
    assert recording.events[0].t == pytest.approx(0.5)
    np.testing.assert_allclose(recording["codes"].times, 0.75)
    assert recording.wire[0].t == pytest.approx(0.75)
    assert 0.75 < recording.wire[-1].t < 0.8
    assert recording.header.duration_s == pytest.approx(recording.wire[-1].t, abs=0.01)
