"""Subjects of a measurement: channels by label, or the whole hand; and groups of subjects as named in tables."""

from aero import channels

CHANNELS = tuple(channel.label for channel in channels.Channel)
FINGERS = tuple(channel.label for channel in channels.FINGERS)
CABLES = tuple(channel.label for channel in channels.CABLES)
THUMB_CABLES = tuple(channel for channel in CABLES if channel not in FINGERS)
HAND = ("hand",)
SUBJECTS = (*CHANNELS, *HAND)
GROUPS: dict[str, tuple[str, ...]] = {
    "channels": CHANNELS,
    "fingers": FINGERS,
    "cables": CABLES,
    "thumb_cables": THUMB_CABLES,
    **{subject: (subject,) for subject in SUBJECTS},
}


def subject_words(subject: str) -> str:
    """Return a subject as words within a sentence: `ring finger`, `thumb CMC flexion`, `hand`."""
    if subject in FINGERS:
        return f"{subject} finger"
    return subject.replace("_", " ").replace("cmc", "CMC")
