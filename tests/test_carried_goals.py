"""test_carried_goals.py BIELLE [rest]: goals of a motion that was carried out are measured on what is in its files, those of the plan stand
beside them, and a difference of more than 5 % is told. With `rest`, of a walk that is pushed."""
import json
import os
import subprocess
import sys
import tempfile

BIELLE = os.path.abspath(sys.argv[1])


def run(*arguments, where):
    result = subprocess.run([BIELLE, *arguments], cwd=where, capture_output=True, text=True,
                            env={**os.environ, "OMP_NUM_THREADS": "1"})
    assert result.returncode == 0, (arguments, result.returncode, result.stdout, result.stderr)
    return result


def read_summary(place, name):
    with open(os.path.join(place, name, "summary.json"), encoding="utf-8") as file:
        return json.load(file)


def measure_speed(place, goal):
    """From the rows of the trajectory."""
    with open(os.path.join(place, "trajectory.csv"), encoding="utf-8") as file:
        rows = [line.split(",") for line in file.read().splitlines()]
    time, x = rows[0].index("time"), rows[0].index("com.x")
    first, last = (rows[1 + goal[key]] for key in ("first_node", "last_node"))
    return (float(last[x]) - float(first[x])) / (float(last[time]) - float(first[time])), float(first[time]), float(last[time])


def list_goals(summary):
    return {goal["name"]: goal for goal in summary["goals"]}


def solve_walk(place):
    run("solve", "walk", "--robot", "bipetto", "--speed", "0.3", "--steps", "6", "--quiet", "--no-check", "--no-report", "-o",
        "walk", where=place)


def main():
    with tempfile.TemporaryDirectory() as place:
        solve_walk(place)
        plan = read_summary(place, "walk")
        warned = {}
        for control in ("gains", "mpc"):
            told = run("simulate", "walk", "-o", control, "--control", control, "--no-report", where=place)
            happened = read_summary(place, control)
            goals, planned = list_goals(happened), list_goals(happened["plan"])
            assert sorted(goals) == sorted(planned) == sorted(list_goals(plan)) == ["footholds", "speed"]
            for name, goal in list_goals(plan).items():
                assert abs(planned[name]["achieved"] - goal["achieved"]) < 1e-9 and planned[name]["met"] == goal["met"]
                assert goals[name]["requested"] == goal["requested"]
            speed, first, last = measure_speed(os.path.join(place, control), goals["speed"])
            assert abs(speed - goals["speed"]["achieved"]) < 1e-9 and happened["steady_speed"] == goals["speed"]["achieved"]
            # The same steps as in the plan, to a row of 5 ms.
            _, plan_first, plan_last = measure_speed(os.path.join(place, "walk"), list_goals(plan)["speed"])
            assert abs(first - plan_first) < 0.006 and abs(last - plan_last) < 0.006
            share = abs(speed / planned["speed"]["achieved"] - 1)
            warned[control] = "warning: speed: " in told.stderr
            assert warned[control] == (share > 0.05) and share < 0.02, (share, told.stderr)
            assert goals["speed"]["met"] == (abs(speed - 0.3) <= goals["speed"]["tolerance"])
            # Gains keep the footholds, on which feet stand to a millimetre; predictive control has room around them.
            assert (goals["footholds"]["achieved"] < 1e-3) == (control == "gains"), goals["footholds"]
            assert (goals["footholds"]["tolerance"] == 0.01) == (control == "gains") and goals["footholds"]["met"]
            # Both lines about solves are of what they say.
            if control == "mpc":
                whole = sorted(row[1] + row[2] for row in happened["solves"]["log"])
                assert happened["solves"]["log_columns"][1:3] == ["whole", "prepare"]
                median = happened["solves"]["with_preparation"]["median_ms"]
                assert whole[0] <= median <= whole[-1] and abs(whole[len(whole) // 2] - median) < 0.02 * median + 0.1
                assert "with their preparation" in told.stdout and "had a solve that would be late in real time" in told.stdout
        assert not warned["gains"]
        # What ends before a goal does not achieve it.
        run("simulate", "walk", "-o", "short", "--control", "gains", "--duration", "0.5", "--no-report", where=place)
        goals = list_goals(read_summary(place, "short"))
        assert goals["speed"]["achieved"] is None and not goals["speed"]["met"], goals
        assert goals["footholds"]["achieved"] is None and not goals["footholds"]["met"], goals


def check_push():
    """It makes the speed another one, which is told if it is."""
    with tempfile.TemporaryDirectory() as place:
        solve_walk(place)
        pushed = run("simulate", "walk", "-o", "pushed", "--control", "mpc", "--push", "t=1.5,impulse=12,direction=0", "--no-report",
                     where=place).stderr
        happened = read_summary(place, "pushed")
        pair = [list_goals(of)["speed"]["achieved"] for of in (happened, happened["plan"])]
        assert ("warning: speed: " in pushed and " was planned" in pushed) == (abs(pair[0] / pair[1] - 1) > 0.05), (pushed, pair)


def check_cycle():
    """A cycle is repeated by gains, without a seam, for as long as is asked."""
    with tempfile.TemporaryDirectory() as place:
        run("solve", "walk", "--robot", "rsu_biped", "--periodic", "-o", "cycle", "--no-check", "--no-report", where=place)
        cycle = read_summary(place, "cycle")["periodic"]
        told = run("simulate", "cycle", "-o", "walked", "--control", "gains", "--duration", "4", "--no-report", where=place).stdout
        walked = read_summary(place, "walked")
        assert walked["outcome"] == "stood" and walked["largest_deviation"] < 2e-3, told
        planned = cycle["offset"]["x_m"] / cycle["period_s"]
        assert abs(walked["distance"] / walked["duration"] / planned - 1) < 0.01, (told, planned)
        # The goal's speed is that of all whole cycles.
        goal = list_goals(walked)["speed"]
        speed, first, last = measure_speed(os.path.join(place, "walked"), goal)
        assert abs(speed - goal["achieved"]) < 1e-9 and abs(speed / planned - 1) < 0.005, (speed, planned)
        assert first == 0 and 4 - cycle["period_s"] < last <= 4, (first, last)


if "rest" in sys.argv:
    check_push()
else:
    main()
    check_cycle()
