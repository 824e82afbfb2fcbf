"""The commands that make and measure what ships; `hil.cli` lists them."""
