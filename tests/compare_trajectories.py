"""Reads trajectory.csv and trajectory.npz with the standard library only; succeeds if they hold the same numbers."""
import ast
import csv
import struct
import sys
import zipfile


def read_npy(data):
    assert data[:8] == b"\x93NUMPY\x01\x00"
    (length,) = struct.unpack("<H", data[8:10])
    assert (10 + length) % 64 == 0 and data[9 + length : 10 + length] == b"\n"
    header = ast.literal_eval(data[10 : 10 + length].decode("latin1"))
    assert header["fortran_order"] is False
    kind, count = header["descr"], 1
    for n in header["shape"]:
        count *= n
    body = data[10 + length :]
    if kind == "<f8":
        values = list(struct.unpack(f"<{count}d", body))
    else:
        assert kind.startswith("<U")
        size = 4 * int(kind[2:])
        assert len(body) == count * size
        values = [body[i * size : (i + 1) * size].decode("utf-32-le").rstrip("\0") for i in range(count)]
    return header["shape"], values


with zipfile.ZipFile(sys.argv[2]) as archive:
    assert archive.testzip() is None
    arrays = {name[:-4]: read_npy(archive.read(name)) for name in archive.namelist()}
with open(sys.argv[1], newline="") as file:
    header, *rows = list(csv.reader(file))

entries = ["fx", "fy", "fz", "nx", "ny", "nz"]
names = {key: arrays[key + "_names"][1] for key in ("q", "v", "u", "closure", "contact")}
columns = [
    ("time", "time", [""]),
    ("q", "q.", names["q"]),
    ("v", "v.", names["v"]),
    ("a", "a.", names["v"]),
    ("u", "u.", names["u"]),
    ("closure_wrenches", "closure.", [f"{n}.{e}" for n in names["closure"] for e in entries]),
    ("contact_wrenches", "contact.", [f"{n}.{e}" for n in names["contact"] for e in entries]),
    ("com", "com.", ["x", "y", "z"]),
    ("gap", "gap.", ["position", "angle"]),
]
for mid, kind in ("q_mid", "q"), ("v_mid", "v"):
    if mid in arrays:
        columns.append((mid, mid + ".", names[kind]))
seen = 0
for array, prefix, suffixes in columns:
    shape, values = arrays[array]
    assert shape[0] in (len(rows), len(rows) - 1), array
    for j, suffix in enumerate(suffixes):
        column = header.index(prefix + suffix)
        cells = [row[column] for row in rows]
        assert [float(c) for c in cells[: shape[0]]] == values[j :: len(suffixes)], prefix + suffix
        assert all(c == "" for c in cells[shape[0] :])
        seen += 1
assert seen == len(header)
