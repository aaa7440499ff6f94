"""A reader of MCAP files with protobuf messages, written from the two formats alone: it trusts no index, and checks all of them.

read(path) returns the file as a dictionary; anything that contradicts the specification is an AssertionError.
"""
import struct
import zlib

MAGIC = b"\x89MCAP0\r\n"
SCALARS = {1: "<d", 2: "<f", 6: "<Q", 7: "<I"}  # of protobuf, with fixed sizes


class Bytes:
    """Reads little-endian values one after the other."""

    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, count):
        piece = self.data[self.at:self.at + count]
        assert len(piece) == count, "the record is too short"
        self.at += count
        return piece

    def number(self, size):
        return int.from_bytes(self.take(size), "little")

    def text(self):
        return self.take(self.number(4))

    def pairs(self, read):
        inside, pairs = Bytes(self.text()), []
        while inside.at < len(inside.data):
            pairs.append(read(inside))
        return pairs

    def end(self):
        assert self.at == len(self.data), "the record is too long"


def split_records(data, start, end):
    """(opcode, content, place, length) of the records between two places."""
    while start < end:
        opcode, length = data[start], int.from_bytes(data[start + 1:start + 9], "little")
        assert start + 9 + length <= end, "a record reaches beyond its section"
        yield opcode, data[start + 9:start + 9 + length], start, 9 + length
        start += 9 + length


def read_definition(opcode, content):
    """A schema or channel, by its id."""
    r = Bytes(content)
    if opcode == 3:
        out = (r.number(2), r.text().decode(), r.text().decode(), r.text())
        assert out[0] > 0
    else:
        out = (r.number(2), r.number(2), r.text().decode(), r.text().decode(),
               dict(r.pairs(lambda x: (x.text(), x.text()))))
    r.end()
    return out


def read_chunk(content, known, messages):
    """Appends its messages; returns first and last time, size and the places of messages by channel."""
    r = Bytes(content)
    first, last, size, checksum = r.number(8), r.number(8), r.number(8), r.number(4)
    assert r.text() == b"", "compressed"
    records = r.take(r.number(8))
    r.end()
    assert len(records) == size and zlib.crc32(records) == checksum, "the checksum of a chunk is wrong"
    places, times = {}, []
    for opcode, inner, place, _ in split_records(records, 0, len(records)):
        if opcode in (3, 4):
            definition = read_definition(opcode, inner)
            known[opcode][definition[0]] = definition
            continue
        assert opcode == 5, opcode
        m = Bytes(inner)
        channel, sequence, time, published = m.number(2), m.number(4), m.number(8), m.number(8)
        assert channel in known[4] and published == time
        messages.append((channel, sequence, time, inner[m.at:]))
        places.setdefault(channel, []).append((time, place))
        times.append(time)
    assert not times or (first, last) == (min(times), max(times))
    return first, last, size, places


def read_data(data, end):
    """Everything up to the end of the data section, which is told by its checksum."""
    known, messages, chunks, metadata = {3: {}, 4: {}}, [], [], []
    for opcode, content, place, length in split_records(data, len(MAGIC), end):
        if opcode == 1:
            assert place == len(MAGIC)
            r = Bytes(content)
            profile, library = r.text(), r.text()
            r.end()
            assert profile == b"" and library.startswith(b"bielle")
        elif opcode == 6:
            chunks.append({"place": (place, length), "content": read_chunk(content, known, messages), "index": {}})
        elif opcode == 7:
            r = Bytes(content)
            channel, entries = r.number(2), r.pairs(lambda x: (x.number(8), x.number(8)))
            r.end()
            assert entries == chunks[-1]["content"][3][channel], "an index of messages is wrong"
            chunks[-1]["index"][channel] = place
            chunks[-1]["index_end"] = place + length
        elif opcode == 12:
            r = Bytes(content)
            name, values = r.text().decode(), dict(r.pairs(lambda x: (x.text().decode(), x.text().decode())))
            r.end()
            metadata.append((place, length, name, values))
        elif opcode == 15:
            assert place + length == end, "the data goes on behind its end"
            assert int.from_bytes(content, "little") == zlib.crc32(data[:place]), "the checksum of the data is wrong"
        else:
            raise AssertionError(f"an unknown record {opcode}")
    return known, messages, chunks, metadata


def check_summary(data, start, end, known, messages, chunks, metadata):
    """The summary repeats schemas and channels, and tells where the rest is."""
    groups, again = {}, {3: {}, 4: {}}
    counted = chunked = described = 0
    for opcode, content, place, length in split_records(data, start, end):
        r = Bytes(content)
        if opcode in (3, 4):
            definition = read_definition(opcode, content)
            again[opcode][definition[0]] = definition
        elif opcode == 8:
            chunk = chunks[chunked]
            first, last, size, _ = chunk["content"]
            assert (r.number(8), r.number(8), r.number(8), r.number(8)) == (first, last, *chunk["place"])
            assert dict(r.pairs(lambda x: (x.number(2), x.number(8)))) == chunk["index"]
            behind = sum(chunk["place"])
            assert r.number(8) == chunk.get("index_end", behind) - behind
            assert (r.text(), r.number(8), r.number(8)) == (b"", size, size)
            r.end()
            chunked += 1
        elif opcode == 11:
            counts = {}
            for message in messages:
                counts[message[0]] = counts.get(message[0], 0) + 1
            assert r.number(8) == len(messages) and r.number(2) == len(known[3]) and r.number(4) == len(known[4])
            assert r.number(4) == 0 and r.number(4) == len(metadata) and r.number(4) == len(chunks)
            assert (r.number(8), r.number(8)) == (messages[0][2], messages[-1][2])
            assert dict(r.pairs(lambda x: (x.number(2), x.number(8)))) == counts
            r.end()
            counted += 1
        elif opcode == 13:
            assert (r.number(8), r.number(8), r.text().decode()) == metadata[described][:3]
            described += 1
        elif opcode == 14:
            group, begin, size = r.number(1), r.number(8), r.number(8)
            assert groups.pop(group) == [begin, begin + size], "a summary offset is wrong"
            continue
        else:
            raise AssertionError(f"an unknown record {opcode} in the summary")
        groups.setdefault(opcode, [place, place])
        assert groups[opcode][1] == place, "records of one kind are not together"
        groups[opcode][1] = place + length
    assert not groups and again == known and counted == 1 and chunked == len(chunks) and described == len(metadata)


# Protobuf, by its wire format.


def split_fields(data):
    """(number, value) of the fields; value is an integer or bytes."""
    at = 0

    def varint():
        nonlocal at
        value = shift = 0
        while True:
            byte = data[at]
            value |= (byte & 0x7f) << shift
            at, shift = at + 1, shift + 7
            if byte < 0x80:
                return value

    while at < len(data):
        key = varint()
        number, kind = key >> 3, key & 7
        if kind == 0:
            yield number, varint()
            continue
        size = {1: 8, 5: 4}.get(kind) or varint()
        assert at + size <= len(data)
        yield number, data[at:at + size]
        at += size


def read_types(descriptor_set):
    """Messages by full name: fields by number, each (name, is repeated, type, name of its type, is optional)."""
    types = {}

    def add(scope, descriptor):
        fields = dict(name=[], field=[], nested=[])
        for number, value in split_fields(descriptor):
            {1: fields["name"], 2: fields["field"], 3: fields["nested"]}.get(number, []).append(value)
        full = scope + "." + fields["name"][0].decode()
        types[full] = {}
        for field in fields["field"]:
            parts = dict(split_fields(field))
            kind = (parts[1].decode(), parts[4] == 3, parts[5], parts.get(6, b"").decode())
            types[full][parts[3]] = kind + (parts.get(17) == 1,)
        for nested in fields["nested"]:
            add(full, nested)

    for number, file in split_fields(descriptor_set):
        assert number == 1
        parts = list(split_fields(file))
        package = next((value.decode() for number, value in parts if number == 2), "")
        for number, value in parts:
            if number == 4:
                add("." + package, value)
    return types


def decode(types, name, data):
    """A message as a dictionary; absent messages and optional fields are None, other absent numbers and texts zero and empty."""
    out = {field: [] if repeated else None if kind == 11 or optional else b"" if kind == 12 else "" if kind == 9 else 0
           for field, repeated, kind, _, optional in types[name].values()}
    for number, value in split_fields(data):
        field, repeated, kind, type_name, _ = types[name][number]
        if kind in SCALARS:
            values = [x for x, in struct.iter_unpack(SCALARS[kind], value)]
        elif kind == 11:
            values = [decode(types, type_name, value)]
        elif kind == 9:
            values = [value.decode()]
        else:
            assert kind in (3, 5, 8, 12, 13, 14), kind
            values = [value]
        if repeated:
            out[field] += values
        else:
            out[field], = values
    return out


def decode_text(data):
    """A text of ROS 2: encapsulation, length with the zero at its end."""
    text = data[8:-1]
    assert data == struct.pack("<BBBBI", 0, 1, 0, 0, len(text) + 1) + text + b"\0"
    return text.decode()


def read(path):
    with open(path, "rb") as file:
        data = file.read()
    assert data.startswith(MAGIC) and data.endswith(MAGIC), "it does not begin and end as an MCAP file"
    end = len(data) - len(MAGIC)
    footer = end - 9 - 20
    assert data[footer] == 2 and int.from_bytes(data[footer + 1:footer + 9], "little") == 20
    start, offsets, checksum = struct.unpack("<QQI", data[footer + 9:end])
    assert zlib.crc32(data[start:end - 4]) == checksum, "the checksum of the summary is wrong"
    known, messages, chunks, metadata = read_data(data, start)
    assert [m[2] for m in messages] == sorted(m[2] for m in messages), "messages are not in the order of time"
    check_summary(data, start, footer, known, messages, chunks, metadata)
    assert next(split_records(data, offsets, footer))[0] == 14
    types = {ident: read_types(schema[3]) for ident, schema in known[3].items() if schema[2] == "protobuf"}
    topics, sequences = {}, {}
    for channel, sequence, time, content in messages:
        assert sequence == sequences.get(channel, 0)
        sequences[channel] = sequence + 1
        _, schema, topic, encoding, _ = known[4][channel]
        if encoding == "cdr":
            assert known[3][schema][1:] == ("std_msgs/msg/String", "ros2msg", b"string data"), topic
            topics.setdefault(topic, []).append((time, decode_text(content)))
            continue
        assert encoding == "protobuf" and known[3][schema][2] == "protobuf"
        topics.setdefault(topic, []).append((time, decode(types[schema], "." + known[3][schema][1], content)))
    return {"topics": topics, "schemas": {topic: known[3][schema][1] for _, schema, topic, _, _ in known[4].values()},
            "types": {name: fields for all_types in types.values() for name, fields in all_types.items()},
            "metadata": {name: values for _, _, name, values in metadata}, "chunks": len(chunks),
            "raw": [(known[4][m[0]][2], m[2], m[3]) for m in messages]}
