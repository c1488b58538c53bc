"""Reads plain accesses as their own simulators document them, and prints `KIND ADDRESS SIZE` a line.

    addresses.py FORM FILE

Written from those documents alone, with nothing but Python's own library: gem5's packet.proto, ChampSim's
trace_instruction.h, Ramulator 2's trace readers, Dinero's din text. `.gz` files are decompressed first.
"""

import gzip
import struct
import sys


def varint(data, at):
    value = shift = 0
    while True:
        byte = data[at]
        at += 1
        value |= (byte & 0x7F) << shift
        shift += 7
        if byte < 0x80:
            return value, at


def messages(data):
    at = 0
    while at < len(data):
        length, at = varint(data, at)
        assert at + length <= len(data), "a cut message"
        yield data[at : at + length]
        at += length


def fields(message):
    found, at = {}, 0
    while at < len(message):
        tag, at = varint(message, at)
        if tag & 7 == 0:
            found[tag >> 3], at = varint(message, at)
        else:
            assert tag & 7 == 2, f"wire type {tag & 7}"
            length, at = varint(message, at)
            found[tag >> 3] = message[at : at + length]
            at += length
    return found


def gem5(data):
    assert data[:4] == b"gem5"
    header, *packets = (fields(message) for message in messages(data[4:]))
    assert isinstance(header[1], bytes) and header[3] > 0, "obj_id and tick_freq"
    ticks = [packet[1] for packet in packets]
    assert ticks == sorted(ticks)
    for packet in packets:
        yield {1: "read", 4: "write"}[packet[2]], packet[3], packet[4]


def champsim(data):
    instruction = struct.Struct("<Q B B 2B 4B 2Q 4Q".replace(" ", ""))
    assert instruction.size == 64
    for ip, branch, taken, *rest in instruction.iter_unpack(data):
        registers, destinations, sources = rest[:6], rest[6:8], rest[8:]
        assert ip > 0 and (branch, taken) == (0, 0) and not any(registers)
        for kind, addresses in (("read", sources), ("write", destinations)):
            for address in addresses:
                if address:
                    yield kind, address - (1 << 40), 0


def ramulator(data):
    for line in data.decode().splitlines():
        operation, address = line.split(" ")
        yield {"LD": "read", "ST": "write"}[operation], int(address, 16), 0


def ramulator_o3(data):
    for line in data.decode().splitlines():
        bubbles, address = line.split(" ")
        assert bubbles == "0"
        yield "read", int(address), 0


def din(data):
    for line in data.decode().splitlines():
        label, address = line.split(" ")
        yield ("read", "write", "fetch")[int(label)], int(address, 16), 0


def words(code):
    return lambda data: (("read", word, 0) for (word,) in struct.iter_unpack(code, data))


READERS = {
    "u32": words("<I"),
    "u64": words("<Q"),
    "din": din,
    "gem5": gem5,
    "ramulator": ramulator,
    "ramulator-o3": ramulator_o3,
    "champsim": champsim,
}

form, path = sys.argv[1:]
with (gzip.open if path.endswith(".gz") else open)(path, "rb") as file:
    contents = file.read()
for access in READERS[form](contents):
    print(*access)
