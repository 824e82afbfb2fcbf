"""The plugin under its earlier name, which editable installations keep as their entry point until they are renewed."""

from aero_hil_pytest import *  # noqa: F403
