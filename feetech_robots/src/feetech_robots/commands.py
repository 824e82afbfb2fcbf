"""Commands added to `aero-hil` by this package."""

from hil.cli.command_table import Command

COMMANDS: dict[str, Command] = {
    "servos": Command("feetech_robots.servos:servos", "Check servos on a bus adapter, and set them up."),
    "emulate-bus": Command("feetech_robots.emulate_bus:emulate_bus", "Serve any robot of bus servos on a port."),
}
