"""Registers by the names of the suite, for drivers that know only addresses: address, size, sign bit."""

STS = {
    "phase": (18, 1, 0),
    "offset": (31, 2, 11),
    "mode": (33, 1, 0),
    "torque_enable": (40, 1, 0),
    "goal_position": (42, 2, 15),
    "goal_pwm": (44, 2, 10),
    "goal_speed": (46, 2, 15),
    "lock": (55, 1, 0),
    "present_position": (56, 2, 15),
    "present_speed": (58, 2, 15),
    "present_load": (60, 2, 10),
    "present_voltage": (62, 1, 0),
}
SCS = {name: (address, size, 0) for name, (address, size, _) in STS.items()}
