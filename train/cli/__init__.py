"""Commands that make data and policies; `aero-hil` finds this table through the entry point `train`."""

from hil.cli.command_table import Command

COMMANDS: dict[str, Command] = {
    "campaign": Command("train.cli.campaign:campaign", "Validate many emulated hands, healthy and faulty.", "campaign"),
    "calibrate": Command("train.cli.calibrate:calibrate_command", "Fit a unit to recordings of a hand."),
    "record": Command("train.cli.record:record_command", "Excite a hand and record it for calibration."),
    "train": Command("train.cli.train:train", "Train a policy.", "train"),
    "evaluate": Command("train.cli.evaluate:evaluate", "Measure a policy on emulated hands with a cube."),
    "convert-policy": Command("train.cli.convert_policy:convert_policy", "Convert a Brax checkpoint to a policy file."),
}
