"""The commands that fit and measure policies, units and the map; `hil.cli` lists them."""
