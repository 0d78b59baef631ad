"""Fixtures of the whole suite."""

import os
from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of real scans and instances, from ``SCANWRIGHT_DATA``."""
    folder = os.environ.get("SCANWRIGHT_DATA")
    if folder and Path(folder).is_dir():
        return Path(folder)
    reason = f"SCANWRIGHT_DATA={folder!r} is not a folder with the real data sets"
    if os.environ.get("SCANWRIGHT_REQUIRE_DATA") == "1":
        pytest.fail(reason)
    pytest.skip(reason)
