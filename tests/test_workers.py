"""test_workers.py BIELLE: campaigns by workers of Work Queue on this machine.

Whatever happens to workers and to the program that gives them their tasks, and whatever workers return, the results are
those of a quiet run without them. Where Work Queue is not installed, nothing is tested (exit status 77).
"""
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time

RESULTS = ("runs.csv", "campaign.md", "summary.json")
# In the place of bielle-simulate: naps, and what comes out follows from its arguments. DONE: a file that lists what has
# been done. BAD: a directory with a file for every kind of result that is none, each returned once, by different runs; if
# there is BAD-always, by any.
CHEAP = r"""#!/bin/sh
for word; do [ "$word" = --dry-run ] && exit 0; done
sleep "${NAP:-0}"
[ -f "$1/summary.json" ] || { echo "bielle: error: no motion"; exit 2; }
out=$3
shift 4
sum=$(echo "$*" | cksum | cut -d ' ' -f 1)
status=$((sum % 3 == 0))
[ $status = 0 ] && outcome=stood || outcome=fell
number=0.$sum
for bad in "${BAD:-/nowhere}"/*; do
  [ -e "$BAD-$sum" ] && [ ! -e "$BAD-always" ] && break
  mv "$bad" "$BAD-$sum" 2>/dev/null || continue
  case $(basename "$bad") in
    nan) number=NaN ;;
    null) number=null ;;
    text) outcome=flew ;;
    status) status=$((1 - status)) ;;
    cut) number='1' ; cut=1 ;;
    missing) exit 0 ;;
    strange) exit 4 ;;
    killed) kill -9 $$ ;;
    large) mkdir -p "$out"; head -c 5000000 /dev/zero | tr '\0' ' ' > "$out/summary.json" ;;
    link) mkdir -p "$out"; ln -s /etc/passwd "$out/summary.json"; exit $status ;;
  esac
  break
done
mkdir -p "$out"
printf '{"outcome": "%s", "outcome_message": "", "duration": 1, "distance": %s, "mean_speed": 0, "largest_deviation": 0,
  "largest_slip": 0, "largest_gap": 0, "energy_balance": 0, "saturated_share": 0%s' $outcome $number "${cut:-\}}" \
  >> "$out/summary.json"
[ -n "$DONE" ] && echo "$*" >> "$DONE"
exit $status
"""
GRID = "motions: [squat]\noptions:\n  friction: [%s]\n  seed: [0, 1, 2, 3, 4, 5, 6, 7]\n"
COUNT, SMALL = 120, 24


def find_port():
    with socket.socket() as one:
        one.bind(("", 0))
        return one.getsockname()[1]


def start(command, log, **environment):
    with open(log, "a") as file:
        return subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=file, stderr=file, start_new_session=True,
                                env={**os.environ, **environment})


class Workers:
    """Workers of one port; all of them are gone in the end."""

    def __init__(self, port, count, password="password", **environment):
        self.command = ["work_queue_worker", "--password", password, "--cores", "1", "--disk", "100", "--memory", "100",
                        "-i", "1", "-b", "1", "-t", "60", "-s", "workers", "localhost", str(port)]
        self.environment = {"NAP": "0.2", **environment}
        self.processes = [self.join() for _ in range(count)]

    def join(self):
        return start(self.command, "workers.log", **self.environment)

    def kill(self, index):
        os.killpg(self.processes[index].pid, signal.SIGKILL)
        self.processes[index].wait()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for index in range(len(self.processes)):
            self.kill(index)


def read(path):
    try:
        with open(path) as file:
            return file.read()
    except FileNotFoundError:
        return ""


def list_runs(out):
    return [json.loads(line)["run"] for line in read(f"{out}/runs.jsonl").splitlines(True)[1:] if line.endswith("\n")]


def wait_for(condition, seconds=60):
    deadline = time.time() + seconds
    while not condition():
        assert time.time() < deadline, "it takes too long"
        time.sleep(0.02)


def check_same(out, serial="small-serial"):
    for name in RESULTS:
        assert read(f"{out}/{name}") == read(f"{serial}/{name}"), name
    assert sorted(read(f"{out}/runs.jsonl").splitlines()) == sorted(read(f"{serial}/runs.jsonl").splitlines())


def campaign(out, port, log, spec="small.yaml"):
    return start([program, "campaign", spec, "-o", out, "--workers", str(port), "--password", "password"], log)


def test_chaos():
    """Eight workers, of which one is killed every half second; their manager is killed twice."""
    port = find_port()
    manager, killed, lost, before = campaign("chaos", port, "chaos.log", "grid.yaml"), 0, 0, []
    with Workers(port, 8, DONE=os.path.abspath("chaos-done")) as workers:
        last = time.time()
        while manager.poll() is None:
            if killed < 2 and len(list_runs("chaos")) > (killed + 1) * COUNT // 3:
                manager.send_signal(signal.SIGKILL)
                manager.wait()
                killed += 1
                before = list_runs("chaos")
                time.sleep(0.5)  # what was under way ends, unheard
                open("chaos-done", "w").close()
                manager = campaign("chaos", port, "chaos.log", "grid.yaml")
            elif time.time() - last > 0.5:
                workers.kill(lost % 8)
                workers.processes[lost % 8] = workers.join()
                lost, last = lost + 1, time.time()
            time.sleep(0.02)
    assert manager.returncode == 0, read("chaos.log")
    assert killed == 2 and lost >= 4, (killed, lost)
    runs, again = list_runs("chaos"), read("chaos-done").splitlines()
    assert len(runs) == len(set(runs)) == COUNT
    assert again and not {f"squat {run}" for run in again} & set(before), "what was finished was done again"
    check_same("chaos", "grid-serial")
    print(f"  {lost} workers lost, {len(before)} runs logged before the manager was killed for the second time")


def test_bad_results():
    """What is no result is told and done again; if it never becomes one, the campaign says so."""
    port = find_port()
    kinds = ("nan", "null", "text", "status", "cut", "missing", "strange", "killed", "large", "link")
    os.mkdir("bad")
    for kind in kinds:
        open(f"bad/{kind}", "w").close()
    with Workers(port, 4, BAD=os.path.abspath("bad"), NAP="0"):
        assert campaign("poisoned", port, "bad.log").wait() == 0, read("bad.log")
    told = read("bad.log")
    assert not os.listdir("bad") and told.count("; retrying") == len(kinds), told
    for words in ("distance is not a number", "no outcome 'flew'", "exit status was", "parse error", "did not write it",
                  "exit status 4", "signal 9", "larger than"):
        assert words in told, (words, told)
    check_same("poisoned")
    shutil.rmtree("bad")
    with open("one.yaml", "w") as file:
        file.write("motions: [squat]\noptions: {seed: 1}\n")
    open("bad-always", "w").close()
    os.mkdir("bad")
    for kind in ("nan", "null", "strange"):
        open(f"bad/{kind}", "w").close()
    with Workers(port, 1, BAD=os.path.abspath("bad"), NAP="0"):
        assert campaign("never", port, "never.log", "one.yaml").wait() == 1
    assert "some runs failed" in read("never.log") and not list_runs("never")


def test_interruption():
    """Ctrl-C: nothing half is left, and the same command goes on."""
    port = find_port()
    manager = campaign("stopped", port, "stopped.log")
    with Workers(port, 4):
        wait_for(lambda: len(list_runs("stopped")) >= 4)
        manager.send_signal(signal.SIGINT)
        assert manager.wait() == 1
        assert "interrupted" in read("stopped.log") and not os.path.exists("stopped/running")
        assert len(list_runs("stopped")) < SMALL
        assert campaign("stopped", port, "stopped.log").wait() == 0
    check_same("stopped")


def test_password():
    """Who does not know the password gets nothing to do."""
    port = find_port()
    with open("wrong", "w") as file:
        file.write("guess\n")
    manager = campaign("guarded", port, "guarded.log", "one.yaml")
    with Workers(port, 1, password="wrong", NAP="0", DONE=os.path.abspath("guarded-done")):
        wait_for(lambda: "start workers with" in read("guarded.log"))
        time.sleep(1.5)
        assert not os.path.exists("guarded-done") and manager.poll() is None
    with Workers(port, 1, NAP="0"):
        assert manager.wait() == 0, read("guarded.log")


def test_arguments():
    def refuse(*arguments, words, command=None):
        result = subprocess.run([command or program, "campaign", "one.yaml", "-o", "x", *arguments], text=True,
                                capture_output=True)
        assert result.returncode == 2 and words in result.stderr, (arguments, result)
    refuse("--workers", "70000", words="it is not a port")
    refuse("--workers", "soon", words="it is not a port")
    refuse("--workers", "auto", "--password", "nowhere", words="nowhere")
    refuse("--password", "password", words="--workers")
    open("empty", "w").close()
    refuse("--workers", "auto", "--password", "empty", words="it is empty")
    with socket.socket() as taken:
        taken.bind(("", 0))
        taken.listen()
        refuse("--workers", str(taken.getsockname()[1]), words="cannot be opened")
    os.mkdir("without")
    for name in ("bielle", "bielle-complete", "bielle-tasks", "bielle-simulate"):
        shutil.copy(os.path.join("bin", name), "without")
    refuse("--workers", "auto", words="coop-computing-tools", command="without/bielle")


def test_real():
    """The real program: robot and motion go with the task, and the bytes are those of a run here."""
    port = find_port()
    with open("real.yaml", "w") as file:
        file.write("motions: [{name: squat, solve: squat, robot: bipetto, "
                   "set: {depth: 0.9, duration: 0.4, settle: 0.1, time_step: 0.02}}]\n"
                   "options: {control: gains, friction: [0.7, 0.1], duration: 0.6}\npush: {time: 0.4, impulse: [1, 40]}\n")
    subprocess.run([built, "campaign", "real.yaml", "-o", "alone"], check=True, stderr=subprocess.DEVNULL,
                   stdout=subprocess.DEVNULL)
    manager = start([built, "campaign", "real.yaml", "-o", "together", "--workers", str(port), "--password", "password"],
                    "real.log")
    # Nothing of this machine's robots is found by name on the workers.
    with Workers(port, 2, BIELLE_ROBOTS="/nowhere"):
        assert manager.wait() == 0, read("real.log")
    for name in RESULTS + ("map.svg",):
        assert read(f"alone/{name}") == read(f"together/{name}"), name


def test_cases():
    """A comparison: runs of a case in a row, robots by their directories, checks beside the command."""
    port = find_port()
    with open("compare.yaml", "w") as file:
        file.write("robots: {rsu: {robot: rsu_biped}}\nmotions: [{motion: squat, set: {depth: 0.9}}]\n")
    command = [built, "compare", "compare.yaml", "-o"]
    subprocess.run([*command, "compare-alone"], check=True, stdout=subprocess.DEVNULL)
    manager = start([*command, "compare-together", "--workers", str(port), "--password", "password"], "compare.log")
    with Workers(port, 1, BIELLE_ROBOTS="/nowhere"):
        assert manager.wait() == 0, read("compare.log")
    for name in ("compare.csv", "compare.md", "cases/rsu-squat-depth-0.9/motion/check.json"):
        assert read(f"compare-alone/{name}") == read(f"compare-together/{name}") != "", name
    summaries = [json.loads(read(f"{place}/cases/rsu-squat-depth-0.9/motion/summary.json").replace(place, "place"))
                 for place in ("compare-alone", "compare-together")]
    for name in ("robot", "robot_file", "command", "cost"):
        assert summaries[0][name] == summaries[1][name], name


def test_design():
    """Two searches, whose manager is interrupted and killed on the way."""
    port = find_port()
    with open("design.yaml", "w") as file:
        file.write("""robot: bipetto
variables:
  - name: crank
    bounds: [0.04, 0.06]
    length:
      - {from: motor_knee_right, to: transmission_knee_right, across: [0, 0, 1], stretch: knee_crank_right}
      - {from: motor_knee_left, to: transmission_knee_left, across: [0, 0, 1], stretch: knee_crank_left}
motions: [{motion: squat, set: {depth: 0.95, duration: 0.6, settle: 0.06, time_step: 0.03}}]
objective: [{measure: peak_torque, motors: [motor_knee_left, motor_knee_right]}]
search: {searches: 2, stages: [{algorithm: crs, evaluations: 4}, {algorithm: slsqp, evaluations: 2}]}
""")

    def list_evaluations(out):
        logs = [read(f"{out}/search{i}.jsonl").splitlines(True) for i in (1, 2)]
        evaluations = [[json.loads(line) for line in log[1:] if line.endswith("\n")] for log in logs]
        return [{name: value for name, value in e.items() if name != "seconds"} for log in evaluations for e in log]
    subprocess.run([built, "design", "design.yaml", "-o", "design-alone"], check=True, stdout=subprocess.DEVNULL)
    command = [built, "design", "design.yaml", "-o", "design-together", "--workers", str(port), "--password", "password"]
    with Workers(port, 2, BIELLE_ROBOTS="/nowhere"):
        for count, number, status in ((2, signal.SIGINT, 1), (5, signal.SIGKILL, -signal.SIGKILL)):
            manager = start(command, "design.log")
            wait_for(lambda: len(list_evaluations("design-together")) >= count)
            manager.send_signal(number)
            assert manager.wait() == status, read("design.log")
        assert "interrupted; run the same command again" in read("design.log")
        assert start(command, "design.log").wait() == 0, read("design.log")
    for name in ("design.md", "best/best.urdf", "best/best.yaml"):
        assert read(f"design-alone/{name}") == read(f"design-together/{name}") != "", name
    assert list_evaluations("design-alone") == list_evaluations("design-together") != []
    assert not os.path.exists("design-together/running")


def test_front():
    """A generation at a time, by three workers, whose manager is killed on the way."""
    port = find_port()
    with open("front.yaml", "w") as file:
        file.write("""generator: fivebar_leg
variables:
  - {name: upper, parameter: upper_length, bounds: [0.06, 0.14]}
  - {name: lower, parameter: lower_length, bounds: [0.15, 0.25]}
motions: [{motion: squat, set: {depth: 0.8, duration: 0.6, settle: 0.06, time_step: 0.03}}]
objective: [{measure: peak_torque}, {measure: cost}]
search: {pareto: {population: 8, generations: 2, refine: {algorithm: slsqp, evaluations: 2}}}
""")
    alone = subprocess.run([built, "design", "front.yaml", "-o", "front-alone"], capture_output=True, text=True)
    if "libpagmo-dev" in alone.stderr:
        print("front: built without pagmo")
        return
    assert alone.returncode == 0, alone.stderr

    def list_evaluations(out):
        log = read(f"{out}/front.jsonl").splitlines(True) if os.path.exists(f"{out}/front.jsonl") else []
        evaluations = [json.loads(line) for line in log[1:] if line.endswith("\n")]
        return sorted(json.dumps({name: value for name, value in e.items() if name != "seconds"}) for e in evaluations)
    command = [built, "design", "front.yaml", "-o", "front-together", "--workers", str(port), "--password", "password"]
    with Workers(port, 3, BIELLE_ROBOTS="/nowhere"):
        manager = start(command, "front.log")
        wait_for(lambda: len(list_evaluations("front-together")) >= 3)
        manager.kill()
        manager.wait()
        done = len(list_evaluations("front-together"))
        assert start(command, "front.log").wait() == 0, read("front.log")
    assert f", {done} of them from the logs" in read("front.log"), read("front.log")
    for name in ("design.md", "best/best.urdf", "front/01/01.urdf", "front/02/02.yaml"):
        assert read(f"front-alone/{name}") == read(f"front-together/{name}") != "", name
    assert list_evaluations("front-alone") == list_evaluations("front-together") != []
    assert not os.path.exists("front-together/running")


if __name__ == "__main__":
    built = os.path.abspath(sys.argv[1])
    companions = os.path.dirname(built)
    if not shutil.which("work_queue_worker") or not os.path.exists(os.path.join(companions, "bielle-workers")):
        print("skipped: no work_queue_worker, or no bielle-workers (packages coop-computing-tools, -dev)")
        sys.exit(77)
    with tempfile.TemporaryDirectory() as place:
        os.chdir(place)
        os.mkdir("bin")
        os.mkdir("workers")
        for name in ("bielle", "bielle-complete", "bielle-design", "bielle-tasks", "bielle-workers"):
            shutil.copy(os.path.join(companions, name), "bin")
        with open("bin/bielle-simulate", "w") as file:
            file.write(CHEAP)
        os.chmod("bin/bielle-simulate", 0o755)
        program = os.path.abspath("bin/bielle")
        with open("password", "w") as file:
            file.write("a word that nobody guesses\n")
        subprocess.run([built, "solve", "squat", "--robot", "bipetto", "--depth", "0.9", "-o", "squat", "--quiet",
                        "--no-report", "--no-check"], check=True, stdout=subprocess.DEVNULL)
        for name, count in (("grid", COUNT), ("small", SMALL)):
            with open(f"{name}.yaml", "w") as file:
                file.write(GRID % ", ".join(f"0.{i}" for i in range(11, 11 + count // 8)))
            subprocess.run([program, "campaign", f"{name}.yaml", "-o", f"{name}-serial", "--jobs", "1"], check=True,
                           stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for name, test in list(globals().items()):
            if name.startswith("test_") and (len(sys.argv) < 3 or name == sys.argv[2]):
                begin = time.time()
                test()
                print(f"{name}: {time.time() - begin:.1f} s", flush=True)
        os.chdir("/")
