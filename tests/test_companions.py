"""test_companions.py BIN SOURCE: companions are built at their first use, once, and never to show their help.

The core is copied into a build tree of its own, whose companions are scripts that CMake writes in no time.
"""
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

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


def check_help(binaries, source):
    """The texts that the core holds are what the programs print."""
    texts = sorted((source / "src/cli/help").glob("*.txt"))
    core = (source / "src/cli/program.cpp").read_text()
    companions = dict(re.findall(r'\{"(\w+)", "[^"]*", (?:"(bielle-\w+)"|kComplete)\}', core))
    commands = {name: program or "bielle-complete" for name, program in companions.items()}
    assert commands.keys() == {text.stem.split("-")[0] for text in texts}, (commands, texts)
    for text in texts:
        words = text.stem.split("-", 1)
        program = commands[words[0]]
        is_alone = program == "bielle-" + words[0] and program != "bielle-bench"
        printed = run(binaries / program, *([] if is_alone else words), "--help")
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


def main(binaries, source):
    check_help(binaries, source)
    with tempfile.TemporaryDirectory() as directory:
        check_building(pathlib.Path(directory), binaries / "bielle", source)


main(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
