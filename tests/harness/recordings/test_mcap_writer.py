"""Our writer of MCAP files writes what the library's does, byte for byte."""

from io import BytesIO

from hypothesis import example, given
from hypothesis import strategies as st
from mcap.writer import Writer

from hil.recordings.mcap_writer import McapWriter

TIMES = st.integers(0, 2**63)
MESSAGES = st.tuples(st.integers(0, 2), TIMES, st.binary(max_size=40))
STEPS = st.lists(st.one_of(MESSAGES, st.sampled_from(["channel", "metadata"])), max_size=60)


def by_the_library(stream, steps, chunk_bytes):
    writer = Writer(stream, chunk_size=chunk_bytes)
    writer.start(profile="", library="ours")
    channels = []
    for step in steps:
        if step == "metadata":
            writer.add_metadata("aero-hil", {"format": "1", "ü": "é"})
        elif step == "channel":
            schema = writer.register_schema("s", "jsonschema", b"{}")
            channels.append(writer.register_channel(f"/{len(channels)}", "json", schema))
        elif channels:
            channel, time, content = step
            writer.add_message(channels[channel % len(channels)], time, content, time)
    writer.finish()


def by_ours(stream, steps, chunk_bytes):
    writer = McapWriter(stream, "ours", chunk_bytes)
    channels = []
    for step in steps:
        if step == "metadata":
            writer.add_metadata("aero-hil", {"format": "1", "ü": "é"})
        elif step == "channel":
            schema = writer.register_schema("s", "jsonschema", b"{}")
            channels.append(writer.register_channel(f"/{len(channels)}", "json", schema))
        elif channels:
            channel, time, content = step
            writer.add_messages([(channels[channel % len(channels)], time, content)])
    writer.finish()


@given(STEPS, st.sampled_from([0, 100, 400, 16_384]))
@example(["channel", (0, 5, b"one"), "channel", (1, 3, b"before"), "metadata", (0, 5, b"two")], 100)
@example([], 100)
def test_same_bytes_as_the_library(steps, chunk_bytes):
    library, ours = BytesIO(), BytesIO()
    by_the_library(library, steps, chunk_bytes)
    by_ours(ours, steps, chunk_bytes)
    assert ours.getvalue() == library.getvalue()
