"""What runs against an Aero Hand Open, real or emulated: channels, actuation map, driver. NumPy and pyserial only."""
