"""test_completion.py BIELLE SOURCE BUILD: completion for bash and zsh offers what the help of each command lists."""
import os
import shlex
import shutil
import subprocess
import sys

from command_help import read_all

program, source, _ = sys.argv[1:]


def complete_bash(words):
    script = f"""source {shlex.quote(source)}/completions/bielle.bash
COMP_WORDS=({' '.join(shlex.quote(word) for word in [program, *words])})
COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1))
_bielle
printf '%s\\n' "${{COMPREPLY[@]}}" """
    run = subprocess.run(["bash", "-c", script], capture_output=True, text=True, check=True)
    assert not run.stderr, run.stderr
    return sorted(run.stdout.split())


# The shell's own functions are replaced by ones that print; zsh alone chooses what fits the word.
def complete_zsh(words):
    script = f"""compadd() {{ shift; print -l -- $@ }}
_files() {{ }}
words=({' '.join(shlex.quote(word) for word in [program, *words])})
CURRENT=$#words
source {shlex.quote(source)}/completions/_bielle"""
    run = subprocess.run(["zsh", "-f", "-c", script], capture_output=True, text=True, check=True)
    assert not run.stderr, run.stderr
    return sorted(word for word in run.stdout.split() if word.startswith(words[-1]))


shells = {"bash": complete_bash}
if shutil.which("zsh"):
    shells["zsh"] = complete_zsh
robots = sorted(line.split()[0] for line in subprocess.check_output([program, "robots"], text=True).splitlines())
assert "bipetto" in robots
helps = read_all(program)
for name, complete in shells.items():
    for entry in helps:
        options = sorted(word for names in entry.options for word in names)
        assert complete([*entry.path, "-"]) == options, (name, entry.path, complete([*entry.path, "-"]), options)
        if entry.commands:
            assert complete([*entry.path, ""]) == sorted(entry.commands), (name, entry.path)
    assert complete(["sol"]) == ["solve"]
    assert complete(["solve", "squat", "--robot", ""]) == robots
    assert complete(["solve", "squat", "--robot", "bip"]) == ["bipetto"]
    assert complete(["solve", "squat", "--formulation", ""]) == ["full", "reduced"]
    assert complete(["info", ""]) == robots
    assert complete(["solve", "squat", "--depth", ""]) == []  # a number: the shell's own completion
    assert complete(["no-such-command", "x"]) == [], name
print(f"{len(helps)} commands in {' and '.join(shells)}")
