"""Joins the LCM bus, or says in one line why this machine cannot."""

import ipaddress
import os
import re
import socket
import sys
from pathlib import Path

from pydrake.lcm import DrakeLcm

from drake_tracker.core.errors import DrakeTrackerError, MachineError
from drake_tracker.network.channels import DEFAULT_URL, PREFIX

_URL = re.compile(r"udpm://([0-9.]+):([0-9]+)(\?.*)?")
_BUFFER = 4_000_000
"""Size of the receive buffer [bytes]; the images of both cameras take 150 000 bytes a cycle."""
_LOOPBACK = socket.inet_aton("127.0.0.1")
_ANY = socket.inet_aton("0.0.0.0")
_IP_MULTICAST_ALL = 49
"""Option of Linux, not named by Python: whether a socket receives what any socket of the machine has joined."""
_PROBE = b"drake-tracker asks itself"
_REMEDY = (
    "on a machine without a network, this lets it send messages to itself, as root: ip link set lo up multicast on && "
    "ip route add 224.0.0.0/4 dev lo"
)


def open_bus(url: str | None = None) -> DrakeLcm:
    """Returns a connection to the bus.

    Without a route for multicast LCM silently falls back to a bus within the process, which no other process receives;
    hence this tests multicast first. With ttl 0, which is also LCM's default, the connection is restricted to the
    loopback interface. The ttl alone would limit sending only, and packets from the network could move the arm.

    Args:
        url: address as LCM writes it, udpm://GROUP:PORT?ttl=N; None is `channels.DEFAULT_URL`.

    Raises DrakeTrackerError when the address is not valid, or the environment forbids the network; MachineError when
    multicast messages do not come back to this machine, or cannot be restricted to the loopback interface.
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
    earlier = _descriptors()
    try:
        lcm = DrakeLcm(with_buffer(url))
        if re.search(r"\bttl=0*[1-9]", url) is None:
            lcm.Subscribe(f"{PREFIX}NOTHING", lambda data: None)  # LCM opens its receiver at the first subscription
            _restrict_to_loopback(match[1], int(match[2]), _descriptors() - earlier)
    except (RuntimeError, OSError) as error:
        kind = MachineError if isinstance(error, OSError) else DrakeTrackerError
        raise kind(f"--lcm {url}: {error}") from None
    return lcm


def _descriptors() -> set[int]:
    """Returns the open file descriptors of this process."""
    return {int(name) for name in os.listdir("/dev/fd")}


def _restrict_to_loopback(group: str, port: int, descriptors: set[int]) -> None:
    """Restricts the sockets of a connection to the loopback interface, for sending and for receiving.

    Args:
        group: address of the multicast group.
        port: port of the connection.
        descriptors: file descriptors, among them those of the connection's sockets; others are not changed.

    Raises OSError when the operating system refuses, or when there is no receiver among them.
    """
    receivers = 0
    for descriptor in descriptors:
        try:
            connection = socket.socket(fileno=os.dup(descriptor))
        except OSError:  # a pipe, or the folder that was listed
            continue
        with connection:
            if connection.type != socket.SOCK_DGRAM or connection.family != socket.AF_INET:
                continue
            connection.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, _LOOPBACK)
            if connection.getsockname() == (group, port):
                receivers += 1
                name = socket.inet_aton(group)
                connection.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, name + _LOOPBACK)
                connection.setsockopt(socket.IPPROTO_IP, socket.IP_DROP_MEMBERSHIP, name + _ANY)
                if sys.platform == "linux":
                    connection.setsockopt(socket.IPPROTO_IP, _IP_MULTICAST_ALL, 0)
    if not receivers:
        raise OSError("the receiver of LCM was not found, and cannot be restricted to this machine; ttl=1 does without")


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
    any_interface = socket.inet_aton(group) + _ANY
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
