"""test_man.py BIELLE SOURCE BUILD: a manual page for every command, with every option, which man formats without warnings."""
import os
import re
import shutil
import subprocess
import sys
import tempfile

from command_help import read_all

program, source, _ = sys.argv[1:]
with tempfile.TemporaryDirectory() as directory:
    subprocess.run([os.path.join(source, "cmake/make_man.sh"), program, "1.2.3", directory], check=True)
    pages = set(os.listdir(directory))
    helps = read_all(program)
    assert len(helps) > 10, helps
    for entry in helps:
        name = "-".join(["bielle", *entry.path]) + ".1"
        assert name in pages, f"no page {name}"
        pages.remove(name)
        path = os.path.join(directory, name)
        with open(path) as file:
            page = file.read().replace("\\-", "-")
        listed = re.findall(r"^\.B (-[^ \n]+)", page, re.MULTILINE)
        assert listed == [",".join(names) for names in entry.options], (name, listed, entry.options)
        commands = page.partition(".SH COMMANDS")[2].partition(".SH")[0]
        assert re.findall(r"^\.B ([^ \n]+)", commands, re.MULTILINE) == entry.commands, name
        # Every word of the help is in the page, but for the headings.
        body = re.sub(r"^(Options|Positionals|Subcommands|Examples):$|^Usage:.*$", "", entry.text, flags=re.MULTILINE)
        words = re.findall(r"[\w=.]+", page.replace("\\&", "").replace("\\e", "\\"))
        missing = set(re.findall(r"[\w=.]+", body)) - set(words) - {word + "." for word in words}
        missing = {word for word in missing if word.rstrip(".") not in words}
        assert not missing, (name, missing)
        if shutil.which("groff"):
            run = subprocess.run(["groff", "-man", "-ww", "-Tutf8", "-z", path], capture_output=True, text=True)
            complaints = [line for line in run.stderr.splitlines() if "can't break line" not in line]
            assert run.returncode == 0 and not complaints, (name, complaints)
    assert not pages, f"pages of no command: {pages}"
    print(f"{len(helps)} pages", "" if shutil.which("groff") else "(no groff here to read them)")
