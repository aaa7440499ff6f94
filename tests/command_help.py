"""Parses the help of the command: its subcommands and options, for tests that compare against it."""
import re
import subprocess


class Help:
    """The help of one command. path: its words, without the program."""

    def __init__(self, program, path):
        self.path = path
        run = subprocess.run([program, *path, "--help"], capture_output=True, text=True)
        self.found = run.returncode == 0
        self.text = run.stdout
        self.options = []  # [["-o", "--output"], ...]
        self.commands = []
        section = ""
        for line in self.text.splitlines():
            if line and not line.startswith(" "):
                section = line.rstrip(":")
            elif not line:
                section = ""
            elif re.match(r"  [^ ]", line):
                first = line.split()[0]
                if section == "Options":
                    self.options.append(first.split(","))
                if section == "Subcommands":
                    self.commands.append(first)


def read_all(program, path=()):
    """The help of the command and of all below it; of programs beside it only where they were built."""
    top = Help(program, list(path))
    if not top.found:
        return []
    found = [top]
    for command in top.commands:
        found += read_all(program, [*path, command])
    return found
