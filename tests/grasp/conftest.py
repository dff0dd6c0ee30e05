import pytest

from drake_tracker.arm.arm_model import make_arm_model
from drake_tracker.arm.description import PUMA560


@pytest.fixture(scope="session")
def arm_model():
    return make_arm_model(PUMA560)
