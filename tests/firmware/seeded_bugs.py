"""Bugs to be put into the real firmware 0.2.0, one at a time, and what has to catch each of them."""

from __future__ import annotations

from dataclasses import dataclass

INO, HOMING = "firmware.ino", "Homing.cpp"
ADDRESS, UNDEFINED = "address", "undefined"


@dataclass(frozen=True)
class Bug:
    """One change of one place."""

    name: str
    file: str
    old: str
    new: str
    session: str | None = None
    """Sessions of `compare` that show it; None where it has no effect without a sanitizer."""
    sanitizer: str | None = None
    """Sanitizer that stops it."""


# A table to be read across.
# ruff: noqa: E501
BUGS = (
    Bug("window of the abduction not shifted", HOMING, "sd[0].extend_count = addoffset", "(void)addoffset", "boot"),
    Bug("acknowledgement one byte short", INO, "memcpy(out + 2, payload, n);\n  }\n  Serial.write(out, sizeof(out)",
        "memcpy(out + 2, payload, n);\n  }\n  Serial.write(out, sizeof(out) - 1", "opcodes"),
    Bug("soft limit missing", INO, "  checkAndEnforceSoftLimits();\n\n", "\n", "torque"),
    Bug("telemetry without the lock", INO, "if (gBusMux && xSemaphoreTake(gBusMux, 0) != pdTRUE) {", "if (false) {",
        "torque"),
    Bug("buffer overrun by one", INO, "for (int i = 0; i < 7; ++i) dst[i] = src[i];",
        "for (int i = 0; i <= 7; ++i) dst[i] = src[i];", None, ADDRESS),
    Bug("channel checked one too late", INO, "if (rawId >= 7) {\n    //invalid", "if (rawId > 7) {\n    //invalid",
        "opcodes", UNDEFINED),
    Bug("homing threshold halved", HOMING, "sd[0].servo_direction, 950", "sd[0].servo_direction, 475", "boot"),
    Bug("search given up after 0.5 s", HOMING, "millis() - t0 > 10000", "millis() - t0 > 500", "homing"),
    Bug("default torque 1000", INO, "{700,700,700,700,700,700,700}", "{1000,700,700,700,700,700,700}", "opcodes"),
    Bug("hot from 75 degrees on", INO, "TEMP_CUTOFF_C    = 70", "TEMP_CUTOFF_C    = 75", "torque"),
    Bug("no floor in torque mode", INO, "HOLD_MAG = 5", "HOLD_MAG = 0", "torque"),
    Bug("homing not stored", INO, "HOMING_start();   // blocks\n      saveExtendsToNVS();", "HOMING_start();", "homing"),
    Bug("bytes of the limit swapped", INO, "(uint8_t)(curLimitRead & 0xFF);", "(uint8_t)(curLimitRead >> 8);", "set_id"),
    Bug("degrees of TRIM without a sign", INO, "int16_t  degrees = (int16_t)rawDeg", "uint16_t  degrees = rawDeg", "opcodes"),
    Bug("position not clamped at the open end", INO, "if (val < 0) val = 0;", "", "opcodes"),
    Bug("position scaled by 65536", INO, "* 65535L", "* 65536L", "opcodes"),
    Bug("telemetry every 11 ms", INO, "pdMS_TO_TICKS(10);", "pdMS_TO_TICKS(11);", "split"),
    Bug("position mode not entered", INO, "if (g_currentMode != MODE_POS) {", "if (false) {", "torque"),
    Bug("lock kept after the scan", INO, "      if (count > 1) break;                    \n    }\n  }\n  if (gBusMux)",
        "      if (count > 1) break;                    \n    }\n  }\n  if (false)", "set_id"),
    Bug("scan ends at 250", INO, "#define SCAN_MAX               253", "#define SCAN_MAX               250", "set_id"),
)  # fmt: skip
