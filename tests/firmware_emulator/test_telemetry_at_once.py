"""The telemetry that is read in one step, beside the same board whose every packet is an event of its own."""

from hypothesis import example, given, settings
from hypothesis import strategies as st
from nightly import NIGHTLY

from firmware_emulator.bench import Bench
from tests.firmware_emulator.conftest import Host

MOMENTS = st.one_of(
    st.integers(0, 60).map(lambda ms: ms / 1000.0),
    st.integers(0, 30).map(lambda ms: ms / 1000.0 - 2e-4),  # what is sent then arrives on a tick
    st.floats(0.0, 0.05),
)
SERVO = st.integers(0, 6)
OPCODES = st.sampled_from((0x03, 0x04, 0x11, 0x12, 0x22, 0x23, 0x24, 0x25, 0x31, 0x32))
FRAMES = st.tuples(OPCODES, st.one_of(SERVO, st.integers(0, 65535)), st.integers(0, 65535))
CHANGES = st.one_of(
    st.tuples(st.just("wait"), MOMENTS),
    st.tuples(st.just("send"), FRAMES),
    st.tuples(st.just("late"), MOMENTS),
    st.tuples(st.just("spoil"), st.integers(0, 150)),
    st.tuples(st.just("listen"), st.none()),
    st.tuples(st.just("leave"), st.none()),
    st.tuples(st.just("silent"), st.tuples(SERVO, MOMENTS)),
    st.tuples(st.just("write"), st.tuples(SERVO, st.integers(0, 75), st.binary(min_size=1, max_size=4))),
    st.tuples(st.just("turn"), st.tuples(SERVO, st.sampled_from((-100.0, -1.0, 0.3, 2.0)))),
    st.tuples(st.just("remove"), SERVO),
    st.tuples(st.just("baud"), SERVO),
    st.tuples(st.just("another master"), st.integers(1, 1200)),
)


class Spoiler:
    """Hears everything, and cuts trains of answers short."""

    def __init__(self, host, left):
        self.heard = []
        self._host, self._left = host, left

    def asked(self, data):
        self.heard.append((self._host.hand.kernel.now, data))

    def answered(self, data):
        self.heard.append((self._host.hand.kernel.now, data))
        return data[: self._left]


def changed(host, what, how):
    hand, bus = host.hand, host.hand.bus
    if what == "wait":
        host.wait(max(how, 0.0))
    elif what == "send":
        host.send(how[0], how[1], *[how[2]] * 6)
    elif what == "late":
        bus.late_s = max(how, 0.0)
    elif what == "spoil":
        bus.tap = Spoiler(host, how)
    elif what == "listen":
        bus.tap = Spoiler(host, 1000)
    elif what == "leave":
        bus.tap = None
    elif what == "silent":
        hand.servos[how[0]].silent_until = hand.kernel.now + how[1]
    elif what == "write":
        hand.servos[how[0]].write(*how[1:])
    elif what == "turn":
        hand.chain.shafts._plant._angles[how[0]] += how[1]
    elif what == "baud":
        hand.servos[how].baud = 500_000
    elif what == "remove":
        bus.servos[:] = [servo for servo in bus.servos if servo is not hand.servos[how]]
    else:
        bus.connect(lambda _: None).write(bytes(how))


def seen(host):
    board = host.hand.board
    telemetry = board.telemetry
    words = (telemetry.positions, telemetry.speeds, telemetry.currents, telemetry.temperatures)
    state = (board.torque_mode.outside, board.mode, host.hand.bus.busy_until, host.hand.kernel.now)
    state += (host.hand.bus.late_s, bytes(board.uart._buffered_trains()))
    tap = host.hand.bus.tap
    return host.link.log, [bytes(s.memory.bytes) for s in host.hand.servos], words, state, tap and tap.heard


@settings(max_examples=2000 if NIGHTLY else 50, deadline=None)
@given(st.sampled_from(("pre", "0.1.1", "0.2.0")), st.lists(CHANGES, max_size=25))
@example("0.2.0", [("wait", 0.028), ("another master", 1200), ("wait", 0.05)])
def test_one_step_is_the_same_as_all_its_events(firmware, changes):
    one, events = Host(plant=Bench(), firmware=firmware), Host(plant=Bench(), firmware=firmware)
    events.hand.kernel.is_free_until = lambda _t: False
    for what, how in [*changes, ("wait", 0.05)]:
        for host in (one, events):
            changed(host, what, how)
        assert seen(one) == seen(events)


def test_a_quiet_board_reads_its_servos_in_one_step(monkeypatch):
    host = Host()
    host.wait(0.05)
    events = []
    call_at = host.hand.kernel.call_at
    monkeypatch.setattr(host.hand.kernel, "call_at", lambda t, *rest: events.append(t) or call_at(t, *rest))
    host.wait(1.0)
    assert len(events) <= 25  # those of what looks after the servos, ten times a second
