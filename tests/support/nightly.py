"""Tests in full, `HYPOTHESIS_PROFILE=nightly`, or in the part that fits into CI."""

import os

NIGHTLY = os.environ.get("HYPOTHESIS_PROFILE") == "nightly"
