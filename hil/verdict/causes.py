"""Where each cause of the catalogue sits, and what kind of effect it has."""

from __future__ import annotations

from hil.verdict.explanation import Effect, Place

CAUSES: dict[str, tuple[Place, Effect]] = {
    "host_stalls": (Place.HOST_AND_DRIVER, Effect.TIMING),
    **dict.fromkeys(("late", "link_slow", "reply_stale", "reply_reordered"), (Place.LINK, Effect.TIMING)),
    **dict.fromkeys(
        (
            "replies_lose_bytes",
            "replies_gain_bytes",
            "replies_alter_bytes",
            "exchanges_lost",
            "commands_damaged",
            "link_silent",
            "link_hangs_up",
        ),
        (Place.LINK, Effect.LOST_BYTES),
    ),
    "boot_text": (Place.BOARD, Effect.RESTART),
    **dict.fromkeys(("board_restart", "board_hangs", "nvs_lost"), (Place.BOARD, Effect.RESTART)),
    "power_cycle": (Place.SUPPLY, Effect.RESTART),
    **dict.fromkeys(("version", "board_of_other_side"), (Place.BOARD, Effect.VERSION)),
    **dict.fromkeys(("supply_low", "supply_sags", "supply_browns_out"), (Place.SUPPLY, Effect.TOO_LITTLE_TORQUE)),
    "late_goals": (Place.SEVERAL_CHANNELS, Effect.TIMING),
    "slow_turnaround": (Place.SEVERAL_CHANNELS, Effect.TIMING),
    "cable_soft": (Place.SEVERAL_CHANNELS, Effect.ELASTIC),
    **dict.fromkeys(
        ("thumb_cables_swapped", "thumb_ids_exchanged", "fingers_exchanged"), (Place.SEVERAL_CHANNELS, Effect.WIRING)
    ),
    **dict.fromkeys(
        ("stuck", "motor_dead", "cable_snapped", "digit_jammed", "servo_not_answering"),
        (Place.ONE_CHANNEL, Effect.NOTHING_MOVES),
    ),
    **dict.fromkeys(
        ("motor_weak", "motor_intermittent", "slow_servo"),
        (Place.ONE_CHANNEL, Effect.TOO_LITTLE_TORQUE),
    ),
    **dict.fromkeys(
        ("gear_friction", "cable_friction", "stiff_joint", "thumb_derailed"),
        (Place.ONE_CHANNEL, Effect.TOO_MUCH_FRICTION),
    ),
    **dict.fromkeys(("spring_off", "spring_strong"), (Place.ONE_CHANNEL, Effect.ELASTIC)),
    **dict.fromkeys(
        ("cable_long", "cable_short", "spool_wrong", "stop_gone", "stop_early", "encoder_play"),
        (Place.ONE_CHANNEL, Effect.LOST_MOTION),
    ),
    **dict.fromkeys(
        (
            "encoder_scale",
            "encoder_creep",
            "encoder_noise",
            "readings_coarse",
            "position_garbage",
            "temperature_wrong",
            "current_wrong",
        ),
        (Place.ONE_CHANNEL, Effect.SENSOR),
    ),
    "servo_hot": (Place.ONE_CHANNEL, Effect.HEAT),
    "answers_missing": (Place.ONE_CHANNEL, Effect.TIMING),
    "winding_reversed": (Place.ONE_CHANNEL, Effect.WIRING),
    **dict.fromkeys(
        ("zero_displaced", "protection_low", "trim_left_in", "calibrated_mid", "calibrated_mid_and_homed"),
        (Place.ONE_CHANNEL, Effect.SETTINGS),
    ),
}
"""By cause (`Kind.cause`)."""
