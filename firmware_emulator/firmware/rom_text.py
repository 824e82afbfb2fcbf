"""What the chip's ROM prints before the firmware, on a connection that outlives the reset.

Source: public logs of ESP32-S3 boards with ESP-IDF 5.5 (rbouteiller/airplay-esp32#18, espressif/esp-idf#12051,
s60sc/ESP32-CAM_MJPEG2SD#432). The hand's own text was never recorded: addresses and lengths are those boards'.
"""

from __future__ import annotations

from firmware_emulator.firmware.boot import ResetCause

REASONS: dict[ResetCause, str] = {
    "power_on": "rst:0x1 (POWERON)",
    "brown_out": "rst:0xf (BROWNOUT_RST)",
    "reset": "rst:0x15 (USB_UART_CHIP_RESET)",
}
_HEAD = "ESP-ROM:esp32s3-20210327\r\nBuild:Mar 27 2021\r\n"
_LOADING = (
    "SPIWP:0xee\r\nmode:DIO, clock div:1\r\nload:0x3fce2820,len:0x159c\r\nload:0x403c8700,len:0xd24\r\n"
    "load:0x403cb700,len:0x2f48\r\nentry 0x403c891c\r\n"
)


def rom_text(cause: ResetCause, *, download: bool = False) -> str:
    """Return the text of a reset; with `download` that of a chip which then waits for esptool."""
    if download:
        waiting = "boot:0x23 (DOWNLOAD(USB/UART0))\r\nSaved PC:0x40041a76\r\nwaiting for download\r\n"
        return f"{_HEAD}{REASONS[cause]},{waiting}"
    saved = "Saved PC:0x403cf2cb\r\n" if cause == "reset" else ""
    return f"{_HEAD}{REASONS[cause]},boot:0x2b (SPI_FAST_FLASH_BOOT)\r\n{saved}{_LOADING}"
