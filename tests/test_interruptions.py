"""test_interruptions.py BIELLE: the command under signals, full disks and closed pipes.

Full disks, closed pipes, unreadable and unwritable places, SIGINT and SIGKILL at any time: a message, the right status, and
no file that is not whole under its name.
"""
import csv
import json
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import zipfile

program = sys.argv[1]
SQUAT = [program, "solve", "squat", "--robot", "bipetto", "--depth", "0.9", "--set", "duration=0.6", "--set", "settle=0",
         "--set", "time_step=0.02"]
NOBODY = 65534


def run(*arguments, status, error="", **options):
    result = subprocess.run([str(a) for a in arguments], stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                            timeout=120, **{"stdout": subprocess.DEVNULL, **options})
    assert result.returncode == status, (arguments, result.returncode, result.stderr)
    assert error in result.stderr, (arguments, result.stderr)
    if error:
        lines = [line for line in result.stderr.splitlines() if line.startswith("bielle: error: ")]
        assert len(lines) == 1, result.stderr
    return result


def check_whole(directory):
    """Every file under its own name is whole, and there is no summary without the trajectory it is of."""
    names = set(os.listdir(directory)) if os.path.isdir(directory) else set()
    if "trajectory.csv" in names:
        with open(os.path.join(directory, "trajectory.csv")) as file:
            rows = list(csv.reader(file))
        assert len(rows) > 2 and len({len(row) for row in rows}) == 1
    if "trajectory.npz" in names:
        with zipfile.ZipFile(os.path.join(directory, "trajectory.npz")) as archive:
            assert archive.testzip() is None and "q.npy" in archive.namelist()
    for name in names & {"summary.json", "check.json"}:
        with open(os.path.join(directory, name)) as file:
            json.load(file)
    if "report.html" in names:
        with open(os.path.join(directory, "report.html")) as file:
            assert file.read().rstrip().endswith("</html>")
    assert "summary.json" not in names or {"trajectory.csv", "trajectory.npz"} <= names, names
    assert "check.json" not in names or "summary.json" in names, names
    return names


def test_standard_output():
    """A full disk behind the standard output is an error; a reader that has seen enough is none, and nothing is said."""
    commands = [["--help"], ["info", "fourbar"], ["robots"], ["eval", "fourbar", "--state", "state.json"],
                ["ratio", "fourbar", "--joint", "rocker_joint"]]
    with open("state.json", "w") as file:
        file.write("{}")
    for command in commands:
        with open("/dev/full", "w") as full:
            run(program, *command, status=2, error="standard output: the output could not be written completely", stdout=full)
    for command in [*commands, ["convert", "fourbar", "--to", "urdf", "-o", "/dev/stdout"]]:
        read, write = os.pipe()
        os.close(read)
        assert "error" not in run(program, *command, status=0, stdout=write).stderr, command
        os.close(write)


def test_reader_that_goes_away():
    """`bielle solve ... | head -1`: the motion is written all the same."""
    read, write = os.pipe()
    os.close(read)
    run(*SQUAT, "--no-check", "-o", "unread", status=0, stdout=write)
    os.close(write)
    assert {"summary.json", "trajectory.npz", "report.html"} <= check_whole("unread")


def test_full_disk():
    """Files that cannot grow, at any size: an error that says so, nothing half under its name."""
    def limit(size):
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # writing fails instead, as on a full disk
        resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))
    refused = 0
    for size in (0, 100, 4096, 20000, 100000, 300000):
        shutil.rmtree("full", ignore_errors=True)
        result = subprocess.run([*SQUAT, "--no-check", "--quiet", "-o", "full"], stdout=subprocess.DEVNULL,
                                stderr=subprocess.PIPE, text=True, preexec_fn=lambda: limit(size))
        names = check_whole("full")
        assert not [name for name in names if ".part" in name], names
        if "summary.json" in names:
            assert result.returncode == 0, result
        else:
            assert result.returncode == 2 and "cannot be written: File too large" in result.stderr, (size, result)
            assert not names, names
            refused += 1
    assert refused >= 3
    run(program, "view", "fourbar", "-o", "/dev/full", status=2, error="/dev/full: file: it cannot be written")
    assert os.path.exists("/dev/full") and not os.path.isfile("/dev/full")


def test_full_file_system():
    """The real thing, where file systems may be mounted."""
    os.mkdir("small")
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=128k", "tmpfs", "small"], stderr=subprocess.DEVNULL).returncode:
        print("  (no file system can be mounted here)")
        return
    try:
        run(*SQUAT, "--quiet", "-o", "small/squat", status=2, error="No space left on device")
        assert not check_whole("small/squat")
    finally:
        subprocess.run(["umount", "small"], check=True)


def test_places():
    """Directories that cannot be read or written, files where directories should be, and the other way round."""
    os.makedirs("closed/robot")
    shutil.copytree(os.path.dirname(find_robot("fourbar")), "readable")
    shutil.copy("readable/fourbar.urdf", "closed/robot/robot.urdf")
    with open("afile", "w") as file:
        file.write("x")
    run(*SQUAT, "-o", "afile", status=2, error="afile: ")
    run(*SQUAT, "-o", "afile/deeper", status=2, error="afile/deeper: ")
    run(program, "info", "afile", status=2, error="afile: ")
    run(program, "info", "nowhere/robot.urdf", status=2, error="no such file or directory")
    run(program, "report", "nowhere", status=2, error="nowhere/summary.json: ")
    run(program, "report", "readable", status=2, error="readable/summary.json: ")
    run(program, "eval", "fourbar", "--state", ".", status=2, error=".: ")
    os.mkdir("readable/fourbar2.urdf")
    run(program, "info", "readable/fourbar2.urdf", status=2, error="fourbar2.urdf: ")
    drop = {"user": NOBODY} if os.getuid() == 0 else {}  # root may read everything
    try:
        run(program, "--version", status=0, **drop)
    except PermissionError:
        print("  (another user may not run the program where it is)")
        return
    os.chmod(".", 0o755)
    os.chmod("closed", 0)
    os.chmod("readable", 0o555)
    run(program, "info", "closed/robot", status=2, error="closed/robot", **drop)
    run(program, "solve", "squat", "--robot", "closed/robot", "-o", "x", status=2, error="closed/robot", **drop)
    run(program, "view", "fourbar", "-o", "readable/page.html", status=2, error="Permission denied", **drop)
    run(*SQUAT, "-o", "readable/squat", status=2, error="readable/squat: ", **drop)
    os.chmod("closed", 0o755)
    os.chmod("readable", 0o755)


def find_robot(name):
    for line in subprocess.check_output([program, "robots"], text=True).splitlines():
        if line.split()[0] == name:
            return line.split(maxsplit=1)[1]
    raise AssertionError(name)


def test_signals():
    """SIGINT and SIGKILL at any time of a solve into a directory that holds an older result, or none."""
    run(*SQUAT, "--quiet", "--no-report", "-o", "older", status=0)
    begin = time.time()
    run(*SQUAT, "--quiet", "-o", "whole", status=0)
    duration = time.time() - begin
    rng = random.Random(1)
    outcomes = {}
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGKILL):
        for trial in range(8):
            shutil.rmtree("killed", ignore_errors=True)
            if trial % 2:
                shutil.copytree("older", "killed")
            child = subprocess.Popen([*SQUAT, "-o", "killed"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                     start_new_session=True)
            time.sleep(rng.uniform(0, 1.1) * duration)
            os.killpg(child.pid, number)  # as the keyboard does: the check that it runs is in the same group
            out, error = child.communicate(timeout=60)
            names = check_whole("killed")
            outcomes.setdefault((number.name, child.returncode), 0)
            outcomes[number.name, child.returncode] += 1
            assert child.returncode in (0, 1, -number), (number, child.returncode, error)
            if child.returncode in (0, 1):  # it had its say: files are there, and tell what became of it
                with open("killed/summary.json") as file:
                    summary = json.load(file)
                assert summary["interrupted"] == ("interrupted" in out.split("squat of bipetto: ")[1].split("\n")[0]), out
                assert child.returncode == 1 or summary["converged"]
                assert "trajectory.npz" in names
    print("  " + ", ".join(f"{name} {status}: {count}" for (name, status), count in sorted(outcomes.items())))
    assert len(outcomes) >= 3


def read_summary(directory):
    with open(os.path.join(directory, "summary.json")) as file:
        return json.load(file)


def test_motions_carried_out():
    """A motion that is watched is in its files before it ends; SIGINT ends it with all of them, SIGKILL with the last ones."""
    if not os.access(os.path.join(os.path.dirname(program), "bielle-simulate"), os.X_OK):
        print("  built without worlds")
        return
    run(*SQUAT, "--quiet", "--no-report", "-o", "plan", status=0)
    command = [program, "simulate", "plan", "--hold", "100", "-o", "carried_out"]
    for number, outcome in ((signal.SIGINT, "was stopped"), (signal.SIGTERM, "was stopped"), (signal.SIGKILL, "running")):
        shutil.rmtree("carried_out", ignore_errors=True)
        child = subprocess.Popen([*command, "--live"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        begin = time.time()
        while not os.path.exists("carried_out/report.html"):  # the last one that is written
            assert time.time() - begin < 60 and child.poll() is None
            time.sleep(0.01)
        assert read_summary("carried_out")["outcome"] == "running"
        child.send_signal(number)
        out, error = child.communicate(timeout=60)
        assert child.returncode == (-number if number == signal.SIGKILL else 1), (child.returncode, error)
        assert "report.html" in check_whole("carried_out")
        summary = read_summary("carried_out")
        assert summary["outcome"] == outcome and not summary["fell"], summary["outcome"]
        if number == signal.SIGKILL:
            continue
        assert "it was stopped" in out
        with open("carried_out/trajectory.csv") as file:
            times = [float(row["time"]) for row in csv.DictReader(file)]
        assert times[0] == 0 and abs(times[-1] - summary["duration"]) < 1e-9 and times[-1] < 100
    run(*command, "--live", "--real-time", status=2, error="leave out --real-time")


def await_(condition, child):
    begin = time.time()
    while not condition():
        assert time.time() - begin < 60 and child.poll() is None, child.communicate()
        time.sleep(0.01)


def catches(child, number):
    with open(f"/proc/{child.pid}/status") as file:
        return int(file.read().split("SigCgt:")[1].split()[0], 16) >> (number - 1) & 1


def test_stopped_at_once():
    """SIGINT while the gains are solved, and within a period of control of a thousand million steps."""
    if not os.access(os.path.join(os.path.dirname(program), "bielle-simulate"), os.X_OK):
        return
    run(*SQUAT, "--quiet", "--no-report", "-o", "planned", status=0)
    child = subprocess.Popen([program, "simulate", "planned", "--control", "gains", "-o", "early"], stdout=subprocess.PIPE,
                             stderr=subprocess.PIPE, text=True)
    await_(lambda: catches(child, signal.SIGINT), child)
    child.send_signal(signal.SIGINT)
    out, error = child.communicate(timeout=10)
    assert child.returncode == 1, (child.returncode, error)
    assert error == "bielle: error: interrupted before the motion began; nothing is written\n", error
    assert not os.path.exists("early")
    help_text = subprocess.check_output([program, "simulate", "--help"], text=True)
    worlds = re.search(r"--world TEXT:{([^}]*)}", help_text).group(1).split(",")
    worlds.remove("simbody")  # which chooses its steps
    assert "bielle" in worlds
    for world in worlds:
        for options in (["--time-step", "1e-12"], ["--record-period", "100", "--hold", "1000", "--summary-only"]):
            shutil.rmtree("tiny", ignore_errors=True)
            child = subprocess.Popen([program, "simulate", "planned", "--control", "gains", "--world", world, *options,
                                      "-o", "tiny"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            await_(lambda: os.path.exists("tiny"), child)
            time.sleep(1)
            child.send_signal(signal.SIGINT)
            out, error = child.communicate(timeout=10)
            assert child.returncode == 1 and "it was stopped" in out, (child.returncode, error)
            summary = read_summary("tiny")
            assert summary["outcome"] == "was stopped" and 0 < summary["duration"] < 1000, summary
            if "--summary-only" not in options:
                check_whole("tiny")
                with open("tiny/trajectory.csv") as file:
                    times = [float(row["time"]) for row in csv.DictReader(file)]
                assert times[0] == 0 and times[-1] == summary["duration"], (times, summary["duration"])


def test_live_on_a_full_disk():
    """A page that cannot be written is told at once, and once; nothing says any longer that the motion is running."""
    if not os.access(os.path.join(os.path.dirname(program), "bielle-simulate"), os.X_OK):
        return
    run(*SQUAT, "--quiet", "--no-report", "-o", "planned", status=0)
    os.mkdir("tight")
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=1400k", "tmpfs", "tight"],
                      stderr=subprocess.DEVNULL).returncode:
        print("  (no file system can be mounted here)")
        return
    try:
        child = subprocess.Popen([program, "simulate", "planned", "--control", "gains", "--hold", "1000", "--live", "-o",
                                  "tight/out"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        await_(lambda: os.path.exists("tight/out/report.html"), child)
        assert read_summary("tight/out")["outcome"] == "running"
        lines = []
        while not lines or "warning" not in lines[-1]:  # tells how far it is, too
            lines.append(child.stderr.readline())
            assert lines[-1], lines
        assert "No space left on device; " in lines[-1] and "the motion goes on" in lines[-1], lines
        assert child.poll() is None
        assert read_summary("tight/out")["outcome"] == "failed"
        with open("tight/out/report.html") as file:
            page = file.read()
        assert '"outcome":"failed"' in page and '"outcome":"running"' not in page
        time.sleep(2.5)  # further pages fail in silence
        child.send_signal(signal.SIGINT)
        out, error = child.communicate(timeout=60)
        assert child.returncode == 2 and "warning" not in error, (child.returncode, error)
        assert "bielle: error: tight/out/" in error and "No space left on device" in error, error
        assert read_summary("tight/out")["outcome"] == "failed"
    finally:
        subprocess.run(["umount", "tight"], check=True)


def test_deep_json():
    """Elements nested so deep that whatever recurses over them would end the program."""
    run(*SQUAT, "--quiet", "--no-report", "-o", "deep", status=0)
    for name in ("summary.json", "check.json"):
        with open(f"deep/{name}") as file:
            text = file.read().rstrip()
        for depth, status in ((50, 0), (300000, 2)):
            with open(f"deep/{name}", "w") as file:
                file.write(text[:-1] + ', "extra": ' + "[" * depth + "]" * depth + "}")
            run(program, "report", "deep", status=status, error="it is nested too deep" if status else "")
            if name == "summary.json":
                run(program, "check", "deep", status=status, error="it is nested too deep" if status else "")
        with open(f"deep/{name}", "w") as file:
            file.write(text)
    for opening, closing in (("[", "]"), ('{"a": ', "}")):
        with open("state.json", "w") as file:
            file.write('{"joints": ' + opening * 300000 + "1" + closing * 300000 + "}")
        run(program, "eval", "fourbar", "--state", "state.json", status=2, error="it is nested too deep")


def test_input_that_stops():
    """A state that is cut short on the standard input, and none at all."""
    for text in ("", "{", '{"joints": {"crank_joint": '):
        result = subprocess.run([program, "eval", "fourbar", "--state", "-"], input=text, capture_output=True, text=True)
        assert result.returncode == 2 and result.stderr.startswith("bielle: error: standard input: "), result


program = os.path.abspath(program)
SQUAT[0] = program
with tempfile.TemporaryDirectory() as place:
    os.chdir(place)
    for name, test in list(globals().items()):
        if name.startswith("test_"):
            begin = time.time()
            test()
            print(f"{name}: {time.time() - begin:.1f} s", flush=True)
    os.chdir("/")
