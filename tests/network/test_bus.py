import os
import subprocess
import sys
import warnings

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


TWO_NETWORKS = """
set -e
ip link set lo up
unshare --net sleep 60 &
stranger=$!
trap 'kill $stranger' EXIT
while [ "$(readlink /proc/$stranger/ns/net)" = "$(readlink /proc/$$/ns/net)" ]; do sleep 0.01; done
ip link add near type veth peer name far netns $stranger
ip addr add 10.77.0.1/24 dev near
ip link set near up
ip route add 224.0.0.0/4 dev near
abroad="nsenter --net --target $stranger"
$abroad ip addr add 10.77.0.2/24 dev far
$abroad ip link set far up
$abroad ip route add 224.0.0.0/4 dev far
echo ready
$PYTHON -c "$RECEIVER" &
receiver=$!
$abroad $PYTHON -c "$FORGER"
wait $receiver
"""
FORGER = """
import time
from pydrake.lcm import DrakeLcm
lcm = DrakeLcm("udpm://239.255.76.67:7667?ttl=1")
for _ in range(100):
    lcm.Publish("X", b"forged")
    time.sleep(0.05)
"""
RECEIVER = """
import time
from pydrake.lcm import DrakeLcm
from drake_tracker.network.bus import open_bus
usual = DrakeLcm("udpm://239.255.76.67:7667?ttl=0")
everyone, ours = open_bus("udpm://239.255.76.67:7667?ttl=1"), open_bus()
came = [[], [], []]
for lcm, messages in zip((usual, everyone, ours), came):
    lcm.Subscribe("X", messages.append)
deadline = time.monotonic() + 30.0
while not (b"forged" in came[0] and b"forged" in came[1] and b"own" in came[2]) and time.monotonic() < deadline:
    ours.Publish("X", b"own")
    for lcm in (usual, everyone, ours):
        lcm.HandleSubscriptions(10)
for _ in range(20):
    ours.HandleSubscriptions(50)
print(b"forged" in came[0], b"forged" in came[1], came[2].count(b"forged"), b"own" in came[2])
"""


def test_packets_from_another_network_are_not_received():
    environment = {**os.environ, "PYTHON": sys.executable, "FORGER": FORGER, "RECEIVER": RECEIVER}
    try:
        child = subprocess.run(
            ["unshare", "--map-root-user", "--net", "bash", "-c", TWO_NETWORKS],
            capture_output=True, text=True, timeout=90, env=environment, check=False,
        )  # fmt: skip
        said = child.stdout.split("\n", 1)
    except OSError as error:
        said = [str(error)]
    if said[0] != "ready":
        warnings.warn("two networks cannot be made here: the bus was tested on this machine only", stacklevel=1)
        return
    assert said[1].split() == ["True", "True", "0", "True"], child.stdout + child.stderr
