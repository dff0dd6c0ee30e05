"""How `fuzz.py` damages bytes, YAML, JSON and the arrays of a log."""

import dataclasses
import json
import re
import struct

NUMBERS = [
    *(0.0, -0.0, 1.0, -1.0, 0.5, 12345.678, 5e-324, 1e-320, 1e18, 1e300, -1e300, 1.8e308, -1.8e308),
    *(float("inf"), float("-inf"), float("nan"), 2.0**31, 2.0**63),
]
SCALARS = [
    *("", "~", "true", "0", "-1", "3.5", "1e308", "-1e308", "5e-324", ".nan", ".inf", "-.inf", "1" + "0" * 400, "x"),
    *("[]", "[1, 2]", "[1, 2, 3]", "[.nan, 0.1, 0.2]", "[[1], [2]]", "{}", "{a: 1}", "'", '"', "&a [*a]", "*a", "&a 1"),
    *("!!python/object/apply:os.system [true]", "!!bool maybe", "!!int ''", "2001-99-99", "59:59:59.5", "0x1F", "1_0"),
    *("!Custom {}", "!Custom {class: 'canary:Part'}", "!Custom {class: 'canary.py:Part', a: 1}", "!Measured {}"),
    *("!CoordinatedTurn {}", "!ClosedPath {x: 1}", "!Lossy {drop: 2}", "!Nope {}", "!SevenJoint {}", "! {}", "!<x> 1"),
    *(
        '"\\e[31m"',
        '"\\ud800"',
        '"\\0"',
        "x" * 10_000,
        "[" * 50,
        "[" * 40 + "]" * 40,
        "../outside/precious",
        "/dev/zero",
    ),
    *("pipe", ".", "train", "oval", "csv", "line", "ball", "<<: *a", "# x", "? x", "- x", "|", ">", "%", "@", "\t"),
]
"""Texts that take the place of a value in YAML."""
_NUMBER = re.compile(r"(?<![\w.])\d+(\.\d+)?(?![\w.])")
VALUES = [
    *(True, None, 0, -1, 3, 10**400, 1e308, "", "x", "x" * 10_000, "\ud800", "\x1b[31m", [], [1], [[1]], {}, {"": ""}),
    *(float("nan"), float("inf"), {"max": "x"}, {"min": 1, "max": [1]}, {"drake_tracker": {}}, "../outside/precious"),
]
"""Values that take the place of a value in JSON."""


def mutate(generator, data, count):
    """Returns bytes after ``count`` changes: another byte, number or integer, a cut, a repetition, an insertion."""
    for _ in range(count):
        place = generator.randrange(len(data) + 1)
        kind = generator.randrange(6)
        if kind == 0:
            data = data[:place] + bytes([generator.randrange(256)]) + data[place + 1 :]
        elif kind == 1:
            data = data[:place] + struct.pack(">d", generator.choice(NUMBERS)) + data[place + 8 :]
        elif kind == 2:
            value = generator.choice([0, -1, 1, 2**63 - 1, -(2**63), 2**31, 10**13, generator.getrandbits(63)])
            data = data[:place] + struct.pack(">q", value) + data[place + 8 :]
        elif kind == 3:
            data = data[:place]
        elif kind == 4:
            data = data[:place] + data[place : place + generator.randrange(1, 300)] * 2 + data[place:]
        else:
            data = data[:place] + generator.randbytes(generator.randrange(40)) + data[place:]
    return data


def scaled(generator, number):
    """Returns a number, given as a text, times a factor."""
    value = float(number) * generator.choice([0.0, 0.5, 0.9, 1.1, 2.0, 10.0, 1e3, 1e6, -1.0])
    return str(int(value)) if number.isdecimal() and abs(value) < float("inf") else repr(value)


def mutate_yaml(generator, text, count):
    """Returns YAML after ``count`` changes: of a number, which may leave it valid, of a line, or of its bytes."""
    for _ in range(count):
        numbers = list(_NUMBER.finditer(text))
        if numbers and generator.random() < 0.5:
            found = generator.choice(numbers)
            text = text[: found.start()] + scaled(generator, found[0]) + text[found.end() :]
            continue
        lines = text.split("\n")
        place = generator.randrange(len(lines))
        line, kind = lines[place], generator.randrange(8)
        if kind < 4 and ":" in line:
            lines[place] = f"{line.partition(':')[0]}: {generator.choice(SCALARS)}"
        elif kind == 4:
            del lines[place]
        elif kind == 5:
            lines.insert(place, lines[generator.randrange(len(lines))])
        elif kind == 6:
            lines[place] = " " * generator.randrange(9) + line.lstrip()
        else:
            data = mutate(generator, text.encode("utf-8", "replace"), 1)
            text = data.decode("utf-8", generator.choice(["replace", "ignore", "surrogateescape"]))
            continue
        text = "\n".join(lines)
    return text


def mutate_json(generator, data, count):
    """Returns the bytes of a JSON document in which ``count`` values, chosen at any depth, are others or missing."""
    if generator.random() < 0.3:
        return mutate(generator, data, count)
    found = json.loads(data)
    for _ in range(count):
        inner = found
        while isinstance(inner, (dict, list)) and inner:
            key = generator.choice(list(inner) if isinstance(inner, dict) else range(len(inner)))
            if not (isinstance(inner[key], (dict, list)) and inner[key]) or generator.random() < 0.5:
                if generator.random() < 0.2:
                    del inner[key]
                else:
                    inner[key] = generator.choice(VALUES)
                break
            inner = inner[key]
    return json.dumps(found).encode()


def mutate_log(generator, log):
    """Returns a copy of a log in which some numbers, samples or signals are damaged or missing."""
    log = dict(log)
    for name in generator.sample(sorted(log), generator.randint(1, 3)):
        signal = log[name]
        times, data = signal.times.copy(), signal.data.copy()
        kind = generator.randrange(7)
        if kind == 0:
            del log[name]
            continue
        if not data.size:
            continue
        column, value = generator.randrange(data.shape[1]), generator.choice(NUMBERS)
        if kind == 1:
            data[generator.randrange(len(data)), column] = value
        elif kind == 2:
            data[:, column] = value
        elif kind == 3:
            data = data * generator.choice([0.0, -1.0, 1e10, 1e200])
        elif kind == 4:
            times = times * generator.choice([0.0, -1.0, 1e-300, 1e3, 1e4])
        elif kind == 5:
            times[generator.randrange(len(times))] = value
        else:
            count = generator.choice([0, 1, 2, generator.randrange(len(times))])
            times, data = times[:count], data[:count]
        log[name] = dataclasses.replace(signal, times=times, data=data)
    return log
