"""Commands that need the emulated hand."""
