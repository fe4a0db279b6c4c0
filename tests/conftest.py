"""What all tests share: property tests draw anew at every run here, and the same every time where CI judges a change.

Real autopilots are flown only where their binaries are named (tests/sitl); they have ports and processors to
themselves, so such a run has one process.
"""

import os
from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("ci", derandomize=True)
if os.environ.get("CI"):
    settings.load_profile("ci")

FIRMWARE = {
    "--px4": "PX4's build folder (px4_sitl_default, with bin/px4 and etc): flies it in tests/sitl.",
    "--arducopter": "ArduCopter's SITL binary: flies it in tests/sitl.",
}


def pytest_addoption(parser: pytest.Parser) -> None:
    """The paths of firmware that was built elsewhere."""
    for name, what in FIRMWARE.items():
        parser.addoption(name, type=Path, metavar="PATH", help=what)


@pytest.hookimpl(tryfirst=True)
def pytest_cmdline_main(config: pytest.Config) -> None:
    """Fly real firmware in one process."""
    if any(config.getoption(name) for name in FIRMWARE):
        config.option.numprocesses = 0
        config.option.dist = "no"
