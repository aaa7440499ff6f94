"""test_package.py CMAKE SOURCE WORK: the preset for packages has no flags of this machine; cpack refuses a build that has."""
import json
import os
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
        commands = " ".join(entry["command"] for entry in json.load(file))
    with open(os.path.join(build, "bielle.pc")) as file:
        return build, commands, file.read()


portable, commands, description = configure("portable")
assert "-O3" in commands and "-march" not in commands + description

native, commands, description = configure("native", "-DBIELLE_NATIVE=ON")
assert "-march=native" in commands and "-march=native" in description
run = subprocess.run([cpack, "-G", "DEB"], cwd=native, capture_output=True, text=True)
assert run.returncode != 0 and "tuned to its machine" in run.stdout + run.stderr, run.stdout + run.stderr
