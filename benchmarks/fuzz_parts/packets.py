"""Cases of `fuzz.py` that come over the network: messages to the host and to the arm, and packets of predicted path."""

import socket
import sys
import threading
from contextlib import suppress
from functools import cache
from http.server import ThreadingHTTPServer
from pathlib import Path

import numpy as np
from arm_computer import GUARD
from bus_ends import Bench, Receiver
from fuzz_parts.mutations import NUMBERS, mutate
from packets import BAD_PACKETS, circle_packet

from drake_tracker.arm.config import ServoConfig
from drake_tracker.arm.motion.servo import Servo
from drake_tracker.core.messages import KNOT_COUNT, PREDICTION_HEADER, Frozen, Prediction, TrackPoint
from drake_tracker.core.processes.loopback_server import LoopbackServer
from drake_tracker.core.timing import SERVO_PERIOD
from drake_tracker.link.config import Lossy
from drake_tracker.link.lossy_link import LinkState, LossyLink
from drake_tracker.network.channels import channel_of, encode_signal
from drake_tracker.network.cycles import AGREEING, REORDERED, NotUnderstood, read_image, read_vector
from drake_tracker.own_cameras.pick import PickServer
from drake_tracker.report.server import make_server

CORPUS = [path.read_bytes() for path in sorted(Path(__file__).parents[2].glob("tests/network/corpus/*.bin"))]

host = cache(Bench)
receiver = cache(Receiver)


def prepare():
    """Starts host and arm, so that no case waits for it."""
    host().good(60)
    receiver()


def message(generator):
    """A message of the corpus, changed in most cases, or any bytes."""
    if generator.random() < 0.1:
        return generator.randbytes(generator.randrange(200))
    return mutate(generator, generator.choice(CORPUS), generator.randrange(5))


def packet(generator, now):
    """A packet for the time ``now`` [s]: good, of a known bad kind, moved and sheared, or with any other numbers."""
    found = circle_packet(now - 0.25, generator.randrange(100), speed=generator.random())
    if generator.random() < 0.5:
        found = generator.choice(list(BAD_PACKETS.values()))[0](found)
    with np.errstate(all="ignore"):
        for _ in range(generator.randrange(3)):
            slope = generator.uniform(-0.1, 0.1) * generator.randrange(2)
            column = PREDICTION_HEADER + generator.randrange(5)
            found[column::5] += generator.uniform(-1.0, 1.0) + slope * np.arange(KNOT_COUNT)
    for _ in range(generator.randrange(4)):
        found[generator.randrange(len(found))] = generator.choice(NUMBERS)
    return found


@cache
def servers():
    """A server of each kind of request: pages, files and JSON; and the errors in their handlers."""
    errors = []
    LoopbackServer.handle_error = lambda *_: errors.append(sys.exception())
    pick = PickServer([np.zeros((4, 6, 3), np.uint8)])
    run = make_server("<p>", ".", ["log.npz"], 0)
    for server in (pick, run):  # `files.prepare` has replaced their own method
        threading.Thread(target=ThreadingHTTPServer.serve_forever, args=(server,), daemon=True).start()
    return [pick, run], errors


def http(generator, folder):
    """Requests to the servers, each cut off somewhere or not; every one is answered, and the next one, too."""
    found, errors = servers()
    server = generator.choice(found)
    host = server.url.removeprefix("http://").rstrip("/")
    body = generator.choice([b'{"roi": [], "follow": ["1,2"]}', b'"\\ud800"', b"[NaN]", b"[" * 3000, b"", b"\xff"])
    length = generator.choice([str(len(body)), "9" * 5000, "-1", "1e9", "", str(2 * len(body)), "0"])
    text = (
        f"{generator.choice(['GET', 'POST', 'HEAD', 'PUT', ''])} {generator.choice(['/', '/pick', '/log.npz', '*'])} "
    )
    text += f"HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nContent-Length: {length}\r\nRange: bytes=0-9\r\n\r\n"
    data = mutate(generator, text.encode() + body, generator.randrange(4))
    # The server may close the connection before all is sent.
    with socket.create_connection(host.split(":"), timeout=5.0) as connection, suppress(OSError):
        connection.sendall(data)
        connection.shutdown(socket.SHUT_WR)
        while connection.recv(65536):  # until the server has closed the connection
            pass
    assert not errors, f"an error in a handler: {errors.pop()!r}"


def read_messages(generator, folder):
    """Messages are read completely or refused."""
    for _ in range(20):
        data = message(generator)
        for read, expected in ((read_image, (8, 4)), (read_vector, TrackPoint.get_fields())):
            try:
                time, content, _ = read(data, expected)
            except NotUnderstood:
                continue
            assert 0.0 <= time <= 1e10, "a time of no run"
            assert read is read_image or len(content) == len(expected), "an incomplete vector"


def host_process(generator, folder):
    """The host goes on sending packets, whatever it received."""
    bench = host()
    for _ in range(generator.randint(1, 4)):
        bench.lcm.Publish(channel_of("point"), message(generator))
    bench.host.step(0.0)
    bench.good(REORDERED + AGREEING)
    bench.lcm.HandleSubscriptions(0)
    before = bench.packets
    bench.good(1)
    bench.lcm.HandleSubscriptions(0)
    assert bench.packets == before + 1, "the host is silent"


def arm_receiver(generator, folder):
    """The arm's receiver passes on finite vectors only, and still accepts a good packet."""
    arm = receiver()
    for _ in range(generator.randint(1, 4)):
        for port in ("prediction", "filtered"):
            arm.lcm.Publish(channel_of(port), message(generator))
        arm.advance()
        for name in ("accepted", "filtered", "packet_report"):
            assert np.isfinite(arm.read(name)).all(), f"{name} is not finite"
    now = arm.simulator.get_context().get_time()
    good = circle_packet(now - 0.1)
    arm.lcm.Publish(channel_of("prediction"), encode_signal(good, Prediction.get_fields(), now).encode())
    arm.advance()
    assert np.array_equal(arm.read("accepted"), good), "a good packet is not accepted"


def link_guard_servo(generator, folder):
    """Link, guard and servo give finite targets, whatever the packets."""
    link = LossyLink(Lossy(drop=0.1, jitter=0.05) if generator.random() < 0.5 else Lossy(), seed=1)
    servo = Servo(ServoConfig(), lead=0.045)
    posted, guarded, state = LinkState(), GUARD.initial_state(), servo.initial_state()
    now, blind = 10.0, generator.randrange(8)
    for k in range(generator.randint(1, 6)):
        posted = link.post(posted, packet(generator, now), now)
        delivered = link.delivered(posted, now)
        if delivered is not None:
            guarded = GUARD.update(guarded, now, delivered)
        for _ in range(3):
            state = servo.update(state, now, guarded.accepted, Frozen.BLIND if k >= blind else Frozen.FREE)
            assert np.isfinite(servo.target(state)).all(), "a target is not finite"
            now += SERVO_PERIOD
