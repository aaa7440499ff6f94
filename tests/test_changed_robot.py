"""test_changed_robot.py BIELLE: a result knows its robot. When the robot's file is edited, every command that reads the result says so
first and goes on with the robot that the motion was solved for."""
import json
import os
import shutil
import subprocess
import sys
import tempfile

BIELLE = os.path.abspath(sys.argv[1])
ROBOT = os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "robots", "bipetto")
SQUAT = ["squat", "--depth", "0.9", "--set", "duration=0.6", "--set", "settle=0", "--set", "time_step=0.02"]
TOLD = "the robot has changed since the motion in "


def run(*arguments, where, status=0):
    result = subprocess.run([BIELLE, *arguments], cwd=where, capture_output=True, text=True,
                            env={**os.environ, "OMP_NUM_THREADS": "1"})
    assert result.returncode == status, (arguments, result.returncode, result.stdout, result.stderr)
    return result


def read(*path):
    with open(os.path.join(*path), encoding="utf-8") as file:
        return file.read()


def write(text, *path):
    with open(os.path.join(*path), "w", encoding="utf-8") as file:
        file.write(text)


def calc_fingerprint(*texts):
    number = 0xcbf29ce484222325
    for byte in "".join(texts).encode():
        number = (number ^ byte) * 0x100000001b3 % 2**64
    return f"{number:016x}"


def read_numbers(place, name):
    """Positions and torques, column by column."""
    rows = [row.split(",") for row in read(place, name, "trajectory.csv").splitlines()]
    keep = [i for i, column in enumerate(rows[0]) if column.startswith(("q.", "u."))]
    return [[float(row[i]) for i in keep if row[i]] for row in rows[1:]]


def calc_distance(place, a, b):
    pairs = zip(read_numbers(place, a), read_numbers(place, b))
    return max(abs(x - y) for row, other in pairs for x, y in zip(row, other))


def simulate(place, name):
    return run("simulate", "squat", "-o", name, "--control", "gains", "--duration", "0.3", where=place)


def use(place):
    """A command that reads a result, with what it says."""
    yield ["check", "squat"], run("check", "squat", where=place)


def use_all(place):
    """Every one."""
    write("motions: [squat]\noptions: {control: gains, duration: 0.02}\n", place, "campaign.yaml")
    for arguments in (["check", "squat"], ["report", "squat", "-o", "page.html"], ["campaign", "campaign.yaml", "-o", "runs"],
                      *(["export", "squat", "--format", form, "-o", "out-" + form]
                        for form in ("sto", "mot", "amp", "mjlab", "mcap", "problem")),
                      ["lift", "serial", "-o", "lifted"]):
        shutil.rmtree(os.path.join(place, "runs"), ignore_errors=True)
        yield arguments, run(*arguments, where=place)


def keep_play():
    """A result keeps what its robot has in worlds alone."""
    with tempfile.TemporaryDirectory() as place:
        robot = shutil.copytree(ROBOT, os.path.join(place, "robot"))
        file = os.path.join(robot, "bipetto.yaml")
        plain = read(file)
        write(plain + '\nplay: {"closure_ankle*": 0.0003, closure_ankle2_left: 0.001, "*ankle1_right": 0}\n'
              "rod_friction: {closure_knee_left: {coefficient: 0.1, radius: 0.01, joints: [free_knee_left]}}\n", file)
        plays = [("closure_ankle2_right", 0.0003), ("closure_ankle1_left", 0.0003), ("closure_ankle2_left", 0.001)]
        info = json.loads(run("info", "robot", "--json", where=place).stdout)
        assert [(play["name"], play["size"]) for play in info["play"]] == plays, info["play"]
        shown = run("info", "robot", where=place).stdout
        assert "play in worlds" in shown and "closure_ankle2_left   0.001" in shown, shown
        run("convert", "robot", "--to", "bielle", "-o", "again", where=place)
        again = json.loads(run("info", "again", "--json", where=place).stdout)
        assert [again[key] for key in ("play", "rod_friction")] == [info[key] for key in ("play", "rod_friction")], again
        assert info["rod_friction"][0]["joints"] == ["free_knee_left"], info["rod_friction"]
        told = run("convert", "robot", "--to", "mjcf", "-o", "robot.xml", where=place).stderr
        assert told.count("is left out: add --play") == len(plays), told
        told = run("solve", *SQUAT, "--robot", "robot", "--quiet", "--no-report", "-o", "squat", where=place).stderr
        assert "friction of rod ends is left out of the plan (closure_knee_left)" in told, told
        simulate(place, "before")
        write(plain, file)
        assert TOLD in run("check", "squat", where=place).stderr.splitlines()[0]
        shutil.rmtree(robot)
        simulate(place, "after")
        for name in ("before", "after"):
            summary = json.loads(read(place, name, "summary.json"))
            assert summary["play"] == dict(plays) and summary["books"]["stop_loss_J"] > 1e-6, summary["books"]
            assert summary["books"]["other_loss_J"] > 1e-4, summary["books"]
        assert calc_distance(place, "before", "after") < 1e-6  # rounding, which stops amplify; play moves joints by 1e-3
        run("simulate", "squat", "-o", "none", "--control", "gains", "--duration", "0.3", "--play", "*=0,hipx_left=0.002",
            where=place)
        assert json.loads(read(place, "none", "summary.json"))["play"] == {**dict(plays), "*": 0, "hipx_left": 0.002}


def main():
    keep_play()
    with tempfile.TemporaryDirectory() as place:
        shutil.copytree(ROBOT, os.path.join(place, "robot"))
        solve = ["solve", *SQUAT, "--robot", "robot", "--quiet", "--no-report", "-o"]
        run(*solve, "squat", where=place)
        run(*solve, "serial", "--model", "serial", "--no-check", where=place)
        summary = json.loads(read(place, "squat", "summary.json"))
        mechanism = [read(place, "squat", name) for name in ("mechanism.urdf", "mechanism.yaml")]
        assert summary["robot_fingerprint"] == calc_fingerprint(*mechanism), summary["robot_fingerprint"]
        for arguments, told in use(place):
            assert "has changed" not in told.stderr, (arguments, told.stderr)
        start = ["solve", *SQUAT, "--robot", "robot", "--warm-start", "squat", "--dry-run"]
        assert "another robot" not in run(*start, where=place).stderr
        simulate(place, "as it was")

        original = read(place, "robot", "bipetto.yaml"), read(place, "robot", "bipetto.urdf")
        mass = original[1].index('<mass value="') + len('<mass value="')
        heavier = original[1][:mass] + "9" + original[1][mass:]
        # A comment changes no mechanism.
        write("# A robot\n" + original[0], place, "robot", "bipetto.yaml")
        assert "has changed" not in run("check", "squat", where=place).stderr
        # Nor does rounding, by which linkages that were mended differ from program to program.
        end = original[1].index('"', mass)
        for factor, is_other in ((1 + 1e-11, False), (1 + 1e-7, True)):
            number = repr(float(original[1][mass:end]) * factor)
            write(original[1][:mass] + number + original[1][end:], place, "robot", "bipetto.urdf")
            assert ("has changed" in run("check", "squat", where=place).stderr) == is_other, number
        for name, text in (("bipetto.urdf", heavier), ("bipetto.urdf", "<robot"), ("bipetto.yaml", original[0] + "gravity: [0, 0, -1.62]\n")):
            write(original[0], place, "robot", "bipetto.yaml")
            write(original[1], place, "robot", "bipetto.urdf")
            write(text, place, "robot", name)
            for arguments, told in (use_all if name == "bipetto.urdf" else use)(place):
                first, motion = told.stderr.splitlines()[0], "serial" if arguments[0] == "lift" else "squat"
                assert first.startswith("bielle: warning: ") and TOLD in first, (arguments, told.stderr)
                assert motion + " was solved for it" in first, (arguments, told.stderr)
                assert os.path.join(place, "robot", "bipetto.urdf") in first and "mechanism.urdf" in first, first
                assert "`" + " ".join([BIELLE, *solve, motion][:2]) in first, first
                assert {heavier: "<mass value=", "<robot": "cannot be read"}.get(text, "gravity: ") in first, first
            if text != "<robot":  # another robot may start from it, which is told as well
                told = run(*start, where=place).stderr
                assert "squat: the motion to start from was solved for another robot" in told.splitlines()[0], told
                assert {heavier: "<mass value="}.get(text, "gravity: ") in told, told
            told = simulate(place, "replayed").stderr
            assert TOLD in told.splitlines()[0], told
            assert calc_distance(place, "as it was", "replayed") < 1e-9
            # What was carried out just now is of that robot, too.
            assert "has changed since the motion in replayed" in run("report", "replayed", "-o", "page.html", where=place).stderr
        # The remedy makes a motion of the new robot, of which nothing is said.
        again = run("solve", *SQUAT, "--robot", "robot", "--quiet", "--no-report", "-o", "moon", where=place)
        assert "has changed" not in run("check", "moon", where=place).stderr + again.stderr

        # Without the robot's files the result is as good.
        shutil.rmtree(os.path.join(place, "robot"))
        for arguments, told in use_all(place):
            assert "has changed" not in told.stderr, (arguments, told.stderr)
        simulate(place, "replayed")
        assert calc_distance(place, "as it was", "replayed") < 1e-9
        # An edited robot in the result is none.
        write(mechanism[0].replace('<mass value="', '<mass value="9', 1), place, "squat", "mechanism.urdf")
        refused = run("check", "squat", where=place, status=2).stderr
        assert "squat/mechanism.urdf" in refused and "the robot that the motion was solved for" in refused, refused
        os.remove(os.path.join(place, "squat", "mechanism.urdf"))
        assert "mechanism.urdf" in run("report", "squat", "-o", "page.html", where=place, status=2).stderr
        # Results of before have neither: their robot is that of the file or name.
        shutil.copytree(ROBOT, os.path.join(place, "robot"))
        del summary["robot_fingerprint"]
        write(json.dumps(summary), place, "squat", "summary.json")
        os.remove(os.path.join(place, "squat", "mechanism.yaml"))
        for arguments, told in use(place):
            assert "has changed" not in told.stderr, (arguments, told.stderr)


main()
