"""Joins the LCM bus, or says in one line why this machine cannot."""

import ipaddress
import re
import socket
from pathlib import Path

from pydrake.lcm import DrakeLcm

from drake_tracker.core.errors import DrakeTrackerError, MachineError
from drake_tracker.network.channels import DEFAULT_URL

_URL = re.compile(r"udpm://([0-9.]+):([0-9]+)(\?.*)?")
_BUFFER = 4_000_000
"""Size of the receive buffer [bytes]; the images of both cameras take 150 000 bytes a cycle."""
_PROBE = b"drake-tracker asks itself"
_REMEDY = (
    "on a machine without a network, this lets it send messages to itself, as root: ip link set lo up multicast on && "
    "ip route add 224.0.0.0/4 dev lo"
)


def open_bus(url: str | None = None) -> DrakeLcm:
    """Returns a connection to the bus.

    Without a route for multicast LCM silently falls back to a bus within the process, which no other process receives;
    hence this tests multicast first.

    Args:
        url: address as LCM writes it, udpm://GROUP:PORT?ttl=N; None is `channels.DEFAULT_URL`.

    Raises DrakeTrackerError when the address is not valid, or the environment forbids the network; MachineError when
    multicast messages do not come back to this machine.
    """
    url = DEFAULT_URL if url is None else url
    match = _URL.fullmatch(url)
    if match is None or not _is_group(match[1]) or not 0 < int(match[2]) < 65536:
        raise DrakeTrackerError(
            f"--lcm {url}: an address is udpm://GROUP:PORT?ttl=N, the group 224.0.0.0 to 239.255.255.255, for example "
            f"{DEFAULT_URL}"
        )
    trouble = multicast_trouble(match[1])
    if trouble:
        raise MachineError(f"--lcm {url}: multicast does not work here ({trouble}); {_REMEDY}")
    try:
        return DrakeLcm(with_buffer(url))
    except RuntimeError as error:
        raise DrakeTrackerError(f"--lcm {url}: {error}") from None


def with_buffer(url: str, most: Path = Path("/proc/sys/net/core/rmem_max")) -> str:
    """Returns the address with as large a receive buffer as the kernel allows, unless the address names one.

    With the usual buffer, 212992 bytes, a busy machine loses some images.

    Args:
        url: the address.
        most: file with the kernel's limit [bytes].
    """
    if "recv_buf_size" in url or not most.is_file():
        return url
    size = min(_BUFFER, int(most.read_text(encoding="ascii")))
    return f"{url}{'&' if '?' in url else '?'}recv_buf_size={size}"


def multicast_trouble(group: str) -> str | None:
    """Returns why a message to a multicast group does not come back to this machine, None when it does."""
    any_interface = socket.inet_aton(group) + socket.inet_aton("0.0.0.0")
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listener,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as speaker,
    ):
        try:
            listener.bind(("", 0))
            listener.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, any_interface)
            listener.settimeout(1.0)
            speaker.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
            speaker.sendto(_PROBE, (group, listener.getsockname()[1]))
            return None if listener.recv(len(_PROBE)) == _PROBE else "another message came back"
        except TimeoutError:
            return "no message came back"
        except OSError as error:
            return error.strerror


def _is_group(address: str) -> bool:
    try:
        return ipaddress.IPv4Address(address).is_multicast
    except ValueError:
        return False
