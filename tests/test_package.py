"""test_package.py CMAKE SOURCE WORK: the preset for packages has flags of a processor nowhere but in the copies of the
library for its level; all code agrees on the alignment of Eigen's types; cpack refuses a build that is tuned to a machine."""
import json
import os
import platform
import re
import shlex
import shutil
import subprocess
import sys

cmake, source, work = sys.argv[1:]
cpack = os.path.join(os.path.dirname(cmake), "cpack")


def configure(name, *options):
    build = os.path.join(work, name)
    shutil.rmtree(build, ignore_errors=True)
    subprocess.run([cmake, "-S", source, "-B", build, "--preset", "package", "-DCMAKE_EXPORT_COMPILE_COMMANDS=ON", *options],
                   check=True, stdout=subprocess.DEVNULL)
    with open(os.path.join(build, "compile_commands.json")) as file:
        # The library is neither in bielle-workers nor in the programs of other engines, which may have flags of their own.
        own = (os.path.join(source, "workers"), os.path.join(source, "validation/loops/engine_"))
        commands = [entry["command"] for entry in json.load(file) if not entry["file"].startswith(own)]
    with open(os.path.join(build, "bielle.pc")) as file:
        return build, commands, file.read()


_, commands, description = configure("portable")
alignment = {"-DEIGEN_MAX_ALIGN_BYTES=64", "-DEIGEN_MAX_STATIC_ALIGN_BYTES=64"}
assert "-march" not in description and alignment <= set(description.split())
levels = {}  # object file -> flags of a processor
for command in commands:
    words = shlex.split(command)
    name = words[words.index("-o") + 1]
    levels[name] = [word for word in words if word.startswith("-m")]
    assert "-O3" in words and alignment <= set(words), command
    if words[-1].endswith(".pb.cc"):  # generated, and not there yet
        continue
    with open(words[-1], encoding="utf-8") as file:
        assert "-fopenmp" in words or "#pragma omp" not in file.read(), command
for name, flags in levels.items():
    level = re.search(r"_objects_(x86-64-v[34])\.dir/", name)
    assert flags[:2] == ([f"-march={level[1]}", "-mtune=generic"] if level else []), (name, flags)
    assert all(re.match("-m(move|store)-max=", flag) for flag in flags[2:]), (name, flags)
if platform.machine() == "x86_64":
    # Every source of the library is compiled for every level.
    for level in ("_x86-64-v3", "_x86-64-v4"):
        assert all(name.replace("_objects.dir", f"_objects{level}.dir") in levels for name in levels if "_objects.dir" in name)

native, commands, description = configure("native", "-DBIELLE_NATIVE=ON")
assert all("-march=native" in command for command in commands) and "-march=native" in description
run = subprocess.run([cpack, "-G", "DEB"], cwd=native, capture_output=True, text=True)
assert run.returncode != 0 and "tuned to its machine" in run.stdout + run.stderr, run.stdout + run.stderr
