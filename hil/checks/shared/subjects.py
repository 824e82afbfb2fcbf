"""What a number is measured on: a channel, by its label, or the whole hand."""

from aero import channels

CHANNELS = tuple(channel.label for channel in channels.Channel)
FINGERS = tuple(channel.label for channel in channels.FINGERS)
CABLES = tuple(channel.label for channel in channels.CABLES)
THUMB = tuple(channel for channel in CHANNELS if channel not in FINGERS)
HAND = ("hand",)
SUBJECTS = (*CHANNELS, *HAND)
