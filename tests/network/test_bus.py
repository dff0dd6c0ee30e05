import pytest

from drake_tracker.core.errors import DrakeTrackerError, MachineError
from drake_tracker.network import bus
from drake_tracker.network.channels import DEFAULT_URL


@pytest.mark.parametrize(
    "url",
    [
        "",
        "239.255.76.67:7667",
        "memq://",
        "udpm://10.0.0.1:7667",
        "udpm://239.255.76.67",
        "udpm://239.255.76.67:99999",
        "udpm://239.255.76.670:7667",
    ],
)
def test_an_invalid_address_is_refused_in_one_line(url):
    with pytest.raises(DrakeTrackerError, match=r"--lcm .*: an address is udpm://GROUP:PORT.*, for example") as caught:
        bus.open_bus(url)
    assert "\n" not in str(caught.value)


def test_a_machine_without_multicast_says_how_to_get_it(monkeypatch):
    monkeypatch.setattr(bus, "multicast_trouble", lambda group: "Network is unreachable")
    with pytest.raises(MachineError, match=r"multicast .*\(Network is unreachable\).*ip route add 224.0.0.0/4"):
        bus.open_bus()


def test_an_address_that_is_no_group_gives_the_error_of_the_operating_system():
    assert bus.multicast_trouble("127.0.0.1")


def test_the_environment_may_forbid_the_network(monkeypatch):
    monkeypatch.setattr(bus, "multicast_trouble", lambda group: None)
    monkeypatch.setenv("DRAKE_ALLOW_NETWORK", "none")
    with pytest.raises(DrakeTrackerError, match="DRAKE_ALLOW_NETWORK"):
        bus.open_bus()


def test_the_buffer_is_as_large_as_the_kernel_allows(tmp_path):
    (tmp_path / "most").write_text("212992\n")
    assert bus.with_buffer(DEFAULT_URL, tmp_path / "most") == f"{DEFAULT_URL}&recv_buf_size=212992"
    assert bus.with_buffer("udpm://239.0.0.1:1", tmp_path / "most") == "udpm://239.0.0.1:1?recv_buf_size=212992"
    named = "udpm://239.0.0.1:1?recv_buf_size=7"
    assert bus.with_buffer(named, tmp_path / "most") == named
    assert bus.with_buffer(DEFAULT_URL, tmp_path / "nothing") == DEFAULT_URL
