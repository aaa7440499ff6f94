"""test_documents.py BINARIES SOURCE PAGE [SOLVED]: runs the commands of a page (README.md or one of docs/) as a reader would.

Blocks of ```sh are run by bash, one after the other, in one empty directory, with `bielle` on the path. A block of ```text
after them shows what they print: its lines must come in this order in what was printed, numbers to the digits
shown, and tiny ones (below 1e-9) as tiny ones; a line may be longer in print, `...` stands for lines left out.
Blocks of ```bash are for the reader alone (builds); what they start must exist. A block of ```cpp must stand, as it is, in
one of the examples, which are built and run by themselves, unless it is the program of README.md (test `install`).

README.md keeps the motions that it solves in the directory SOLVED; other pages take from there what they would solve again by the
same command.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time

NUMBER = re.compile(r"[-+−]?\d+(?:\.\d+)?(?:[eE][-+]?\d+)?")
BY_HAND = ("BIELLE_ROBOTS=path/to/", "scripts/", "cmake ", "ctest ", "ninja ", "apt ", "sudo apt ", "python3 examples/")


# `bielle` as a function of the shell, around the command: its argument -o comes last in the pages.
KEY = """key() { printf '%s' "$*" | tr ' /' '__'; }
"""
KEEP = KEY + """bielle() {
  if [ "$1" != solve ]; then command bielle "$@"; return; fi
  command bielle "$@" 2>&1 | tee "$SOLVED/$(key "$@").txt"
  cp -r "${@: -1}" "$SOLVED/$(key "$@")"
}
"""
TAKE = KEY + """bielle() {
  if [ ! -d "$SOLVED/$(key "$@")" ]; then command bielle "$@"; return; fi
  cp -r "$SOLVED/$(key "$@")" "${@: -1}"
  cat "$SOLVED/$(key "$@").txt"
}
"""


def read_blocks(path):
    """[(language, text, line), ...]"""
    blocks, language, lines, start = [], None, [], 0
    with open(path, encoding="utf-8") as file:
        for number, line in enumerate(file, 1):
            if line.startswith("```"):
                if language is None:
                    language, lines, start = line[3:].strip(), [], number
                else:
                    blocks.append((language, "".join(lines), start))
                    language = None
            elif language is not None:
                lines.append(line)
            elif line.startswith("    bielle "):
                raise AssertionError(f"{path}:{number}: a command outside of a block that is run")
    assert language is None, f"{path}: a block is not closed"
    return blocks


def is_same_number(shown, printed):
    expected, found = float(shown.replace("−", "-")), float(printed.replace("−", "-"))
    if abs(expected) < 1e-9:
        return abs(found) < 1e-9
    mantissa, _, exponent = shown.lower().partition("e")
    decimals = len(mantissa.partition(".")[2])
    unit = 10.0 ** (int(exponent or 0) - decimals) if decimals or exponent else 0  # whole numbers count something
    return abs(expected - found) <= 1.01 * unit


def matches(shown, printed):
    """Whether a printed line begins as the one shown, blanks and the digits of numbers aside."""
    wanted, found = NUMBER.findall(shown), NUMBER.findall(printed)
    begin, line = (" ".join(NUMBER.sub("#", text).split()) for text in (shown, printed))
    return line.startswith(begin) and all(map(is_same_number, wanted, found))


def check_output(shown, printed, place):
    lines = iter(printed.splitlines())
    for line in shown.splitlines():
        if line.strip() in ("", "..."):
            continue
        assert any(matches(line, candidate) for candidate in lines), \
            f"{place}: not printed (in this order): {line}\nwhat was printed:\n{printed}"


def check_by_hand(text, source, place):
    for line in text.splitlines():
        command = line.split("#")[0].strip()
        assert not command or command.startswith(BY_HAND), f"{place}: '{command}' could be run: use a block of ```sh"
        if command.startswith("scripts/"):
            subprocess.run(["bash", "-n", os.path.join(source, command.split()[0])], check=True)
        if command.startswith("python3 "):
            assert os.path.exists(os.path.join(source, command.split()[1])), f"{place}: there is no {command.split()[1]}"


def check_program(text, source, place):
    folder = os.path.join(source, "examples")
    for name in sorted(os.listdir(folder)):
        if not name.endswith(".cpp"):
            continue
        with open(os.path.join(folder, name), encoding="utf-8") as file:
            if text in file.read():
                return
    raise AssertionError(f"{place}: this program is in none of the examples")


def main():
    binaries, source, page = sys.argv[1:4]
    environment = {**os.environ, "PATH": binaries + ":" + os.environ["PATH"], "LC_ALL": "C.UTF-8"}
    environment.pop("BIELLE_ROBOTS", None)
    prelude = ""
    if len(sys.argv) > 4:
        environment["SOLVED"] = sys.argv[4]
        prelude = KEEP if page == "README.md" else TAKE
        if page == "README.md":
            shutil.rmtree(sys.argv[4], ignore_errors=True)
            os.makedirs(sys.argv[4])
    checked, printed = 0, ""
    with tempfile.TemporaryDirectory() as directory:
        for language, text, line in read_blocks(os.path.join(source, page)):
            place = f"{page}:{line}"
            if language == "sh":
                begin = time.time()
                result = subprocess.run(["bash", "-euo", "pipefail", "-c", prelude + text], cwd=directory, env=environment,
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
                assert result.returncode == 0, f"{place}: status {result.returncode}\n{text}\n{result.stdout}"
                printed, checked = result.stdout, checked + 1
                print(f"{place}: {time.time() - begin:.1f} s")
            elif language == "text":
                check_output(text, printed, place)
            elif language == "bash":
                check_by_hand(text, source, place)
                checked += 1
            elif language == "cpp" and page != "README.md":
                check_program(text, source, place)
                checked += 1
    assert checked, f"{page} has no block that is checked"


main()
