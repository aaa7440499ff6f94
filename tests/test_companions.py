"""test_companions.py BIELLE SOURCE: companions are built at their first use, once, and never to show their help.

The core is copied into a build tree of its own, whose companions are scripts that CMake writes in no time.
"""
import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time

PROJECT = """cmake_minimum_required(VERSION 3.22)
project(small NONE)
add_custom_command(OUTPUT ${CMAKE_BINARY_DIR}/bin/bielle-design
  COMMAND sh ${CMAKE_SOURCE_DIR}/make.sh VERBATIM)
add_custom_target(bielle-design DEPENDS ${CMAKE_BINARY_DIR}/bin/bielle-design)
"""
MAKE = """echo made >> made
sleep 1
if [ -e fails ]; then exit 1; fi
printf '#!/bin/sh\\necho companion: "$@"\\n' > bin/bielle-design
chmod +x bin/bielle-design
"""


def run(core, *arguments):
    environment = {"PATH": os.environ["PATH"], "HOME": os.environ.get("HOME", "/")}
    return subprocess.run([core, *arguments], capture_output=True, text=True, env=environment)


def check_help(core, source):
    """Every command that the core has not has a text in it, and that is what its program prints."""
    texts = sorted((source / "src/cli/help").glob("*.txt"))
    commands = set(re.findall(r"^  (\w+)  ", run(core, "--help").stdout.partition("Subcommands:")[2], re.M))
    assert commands - {"solve", "report", "info", "robots"} == {text.stem.split("-")[0] for text in texts}, commands
    for text in texts:
        printed = run(core, *text.stem.split("-", 1), "--help")
        assert printed.returncode == 0, printed
        assert printed.stdout == text.read_text(), f"{text}: run scripts/update_help.sh"


def make_tree(directory, core):
    (directory / "source").mkdir()
    (directory / "source/CMakeLists.txt").write_text(PROJECT)
    (directory / "source/make.sh").write_text(MAKE)
    tree = directory / "tree"
    subprocess.run(["cmake", "-G", "Ninja", "-S", directory / "source", "-B", tree], check=True, stdout=subprocess.DEVNULL)
    (tree / "bin").mkdir()
    (tree / "companions.txt").write_text("bielle\nbielle-design\n")
    shutil.copy(core, tree / "bin/bielle")
    return tree


def count_makes(tree):
    made = tree / "made"
    return len(made.read_text().splitlines()) if made.exists() else 0


def check_building(directory, core, source):
    tree = make_tree(directory, core)
    core = tree / "bin/bielle"
    printed = run(core, "design", "--help")
    assert printed.stdout == (source / "src/cli/help/design.txt").read_text() and count_makes(tree) == 0, printed
    printed = run(core, "generate", "delta", "--help")  # the longest text that there is
    assert printed.stdout == (source / "src/cli/help/generate-delta.txt").read_text(), printed
    assert "design" in run(core, "--help").stdout and count_makes(tree) == 0

    (tree / "fails").write_text("")
    printed = run(core, "design", "some.yaml")
    assert printed.returncode == 2 and "goes on from there" in printed.stderr, printed
    (tree / "fails").unlink()
    (tree / "made").unlink()

    # Ctrl-C ends the build, which begins anew; where the core alone is killed, it goes on, and the next call waits for it.
    for ends, makes in ((lambda call: os.killpg(call.pid, signal.SIGINT), 2), (lambda call: call.kill(), 1)):
        with subprocess.Popen([core, "design", "a.yaml"], stderr=subprocess.DEVNULL, start_new_session=True) as call:
            while count_makes(tree) == 0:
                time.sleep(0.01)
            ends(call)
        printed = run(core, "design", "b.yaml")
        assert printed.stdout == "companion: design b.yaml\n" and count_makes(tree) == makes, printed
        (tree / "bin/bielle-design").unlink()
        (tree / "made").unlink()

    calls = [subprocess.Popen([core, "design", f"{name}.yaml"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
             for name in "ab"]
    outputs = [call.communicate() for call in calls]
    assert [call.returncode for call in calls] == [0, 0], outputs
    assert sorted(out for out, _ in outputs) == ["companion: design a.yaml\n", "companion: design b.yaml\n"], outputs
    assert count_makes(tree) == 1, "two calls at once build once"
    assert sum("bielle: building bielle-design" in error for _, error in outputs) == 1, outputs
    assert any(re.search(r"bielle: built bielle-design in \d+ s", error) for _, error in outputs), outputs

    printed = run(core, "design", "c.yaml")
    assert printed.stdout == "companion: design c.yaml\n" and printed.stderr == "" and count_makes(tree) == 1, printed

    for arguments in (["bench"], ["campaign", "x.yaml", "-o", "y"], ["check", "squat"]):  # not in this tree's list
        printed = run(core, *arguments)
        assert printed.returncode == 2 and "is neither beside this program nor on the PATH; " in printed.stderr, printed
    assert run(core, "check", "--help").stdout == (source / "src/cli/help/check.txt").read_text()


def main(core, source):
    check_help(core, source)
    with tempfile.TemporaryDirectory() as directory:
        check_building(pathlib.Path(directory), core, source)


main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
