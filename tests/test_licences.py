"""test_licences.py BIELLE SOURCE: the licences of all shipped parts are present where required."""
import os
import subprocess
import sys
import tempfile

program, source = os.path.abspath(sys.argv[1]), sys.argv[2]
with open(os.path.join(source, "LICENSE"), encoding="utf-8") as file:
    licence = file.read()
assert licence.startswith("BSD 3-Clause License") and "Redistribution and use" in licence
with open(os.path.join(source, "CITATION.cff"), encoding="utf-8") as file:
    assert "license: BSD-3-Clause" in file.read()
# Robots derived from published ones carry their licence.
for robot in sorted(os.listdir(os.path.join(source, "robots"))):
    folder = os.path.join(source, "robots", robot)
    if not os.path.isdir(folder):
        continue
    readme = os.path.join(folder, "README.md")
    assert os.path.exists(readme), f"{robot} has no README.md"
    with open(readme, encoding="utf-8") as file:
        text = file.read()
    if "published by" in text:
        assert "Redistributions of source code must retain" in text, f"{robot}: whose figures, under which licence?"
# A page holds libraries of others, and their notices.
with tempfile.TemporaryDirectory() as place:
    page = os.path.join(place, "page.html")
    subprocess.run([program, "view", "fourbar", "-o", page], check=True, stdout=subprocess.DEVNULL)
    with open(page, encoding="utf-8") as file:
        text = file.read()
for part in ("THREE", "Dygraph", "three.js authors", "Dan Vanderkam", "Permission is hereby granted"):
    assert part in text, part
# No incompatible licence is mentioned.
for folder, _, names in os.walk(os.path.join(source, "src")):
    for name in names:
        with open(os.path.join(folder, name), encoding="utf-8", errors="replace") as file:
            assert "GNU General Public" not in file.read(), os.path.join(folder, name)
