import pytest

from drake_tracker.arm.description import PUMA560, make_arm_model


@pytest.fixture(scope="session")
def arm_model():
    return make_arm_model(PUMA560)
