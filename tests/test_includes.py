"""test_includes.py SOURCE: includes run one way, and third-party headers appear only in the files listed here."""
import os
import re
import sys

# Direct dependencies of each room; a room may also include itself and their dependencies.
ROOMS = {
    "math": [],
    "model": ["math"],
    "dynamics": ["model"],
    "firmware": ["dynamics"],
    "formats": ["dynamics"],
    "robots": ["formats"],
    "solve": ["math"],
    "ocp": ["dynamics", "solve"],
    "motion": ["ocp", "formats"],
    "control": ["motion"],
    "results": ["motion", "robots"],
    "worlds": ["control", "results", "firmware"],
    "identify": ["results"],
    "report": ["results"],
    "design": ["results"],
    "tasks": ["design"],
    "bench": ["worlds"],
    "cli": ["report", "tasks", "bench", "worlds", "firmware", "identify"],
    "validation": ["bench"],
    "paper": ["tasks"],
    "workers": [],
}
TOP = ("validation", "workers")  # rooms outside src
PAPER = "validation/paper/"  # the room "paper"
# Prefixes of third-party headers, and the files or folders that may include them.
OTHERS = {
    "yaml-cpp/": ["src/formats/yaml_entry.cpp", "src/formats/yaml_progress.h", "src/formats/yaml_tree.cpp", "src/formats/robot_writer.cpp",
                  "src/formats/adopt.cpp", "src/formats/mjcf.cpp"],
    "muParser": ["src/formats/expressions.cpp"],
    "urdf_": ["src/formats/reader_urdf.cpp"],
    "tinyxml": ["src/formats/xml_document.h"],
    "sdf/": ["src/formats/reader_sdf.h", "tests/test_sdf.cpp"],
    "google/protobuf/": ["src/results/motion_mcap.cpp"],
    "zlib.h": ["src/results/mcap_file.cpp"],
    "zip.h": ["src/results/npz.cpp"],
    "nlopt": ["src/motion/slsqp.cpp", "src/design/nlopt_search.h"],
    "ceres/": ["src/identify/least_squares.cpp"],
    "pagmo/": ["src/design/front_search.cpp"],
    "CLI/": ["src/cli/", "src/results/failure_message.h", "src/results/number_option.h", "validation/", "suite/"],
    "Ip": ["suite/ipopt_solver.cpp"],
    "nlohmann/": ["src/", "validation/", "workers/", "tests/"],
    "cctools/": ["workers/"],
    "Simbody": ["src/worlds/", "validation/"],
    "SimTK": ["src/worlds/", "validation/"],
    "simbody/": ["src/worlds/", "validation/"],
    "dart/": ["validation/loops/engine_dart.cpp"],
    "ode/": ["validation/loops/engine_ode.cpp"],
    "mujoco/": ["src/worlds/", "validation/"],
    "pybind11/": ["python/"],
}
PUBLIC = "include/bielle/"
OUTSIDE = ("examples/", "python/", "tests/consumer/")  # they see what users see, and the worlds of engines
GENERATED = ("assets.inc", "help.inc", "functions.inc", "foxglove.pb.h", "motion.pb.h")
FOLDERS = ("include/", "src/", "validation/", "workers/", "suite/", "tests/", "examples/", "python/")


def collect(room):
    """The rooms that a room may include."""
    rooms = {room}
    for below in ROOMS[room]:
        rooms |= collect(below)
    return rooms


def find_room(path):
    """The room of a file; None for those that may see all rooms."""
    for folder in (PUBLIC, "src/"):
        if path.startswith(folder):
            rest = path[len(folder):]
            return rest.split("/")[0] if "/" in rest else None
    if path.startswith(PAPER):
        return "paper"
    folder = path.split("/")[0]
    return folder if folder in TOP else None


def resolve(path, name, files):
    """The file of this project that `path` includes by `name`, if it is one."""
    for folder in ("", "include/", "src/", os.path.dirname(path) + "/", "validation/", "suite/", "tests/"):
        target = os.path.normpath(folder + name)
        if target in files:
            return target
    return None


def check_include(path, name, quoted, files):
    """What is wrong with an include; None when nothing is."""
    target = resolve(path, name, files)
    if target is None:
        if quoted and name not in GENERATED:
            return "there is no such file"
        for start, places in OTHERS.items():
            if name.startswith(start) and not any(path.startswith(place) for place in places):
                return "only " + ", ".join(places) + " may include it"
        return None
    if target.startswith(PUBLIC):
        pass
    elif path.startswith(PUBLIC):
        return "a public header includes one that is not installed"
    elif path.startswith(OUTSIDE) and target.startswith("src/") and not target.startswith("src/worlds/"):
        return "users see public headers only"
    room, other = find_room(path), find_room(target)
    if room is not None and room not in ROOMS:
        return f"'{room}' is no room: add it to ROOMS"
    if room and other and other not in collect(room):
        return f"{room} may include {', '.join(sorted(collect(room)))}"
    return None


def check_file(path, text, files):
    problems = []
    for number, line in enumerate(text.splitlines(), 1):
        match = re.match(r'\s*#\s*include\s*(["<])([^">]+)[">]', line)
        problem = match and check_include(path, match[2], match[1] == '"', files)
        if problem:
            problems.append(f"{path}:{number}: {line.strip()}: {problem}")
    if path.endswith("CMakeLists.txt") and not path.startswith(("src/worlds/", "validation/")) and "find_package(Simbody" in text:
        problems.append(f"{path}: only worlds and validation link Simbody")
    if path.endswith("CMakeLists.txt") and not path.startswith("workers/") and "work_queue" in text.lower():
        problems.append(f"{path}: only workers links Work Queue")
    return problems


def check_document(path, text, files):
    problems = []
    for name in re.findall(r"`([\w/]+/\w+\.(?:h|cpp))`", text):
        if not any(folder + name in files for folder in ("", "include/", PUBLIC)):
            problems.append(f"{path}: `{name}`: there is no such file")
    return problems


def check_planted():
    """Every kind of violation is noticed."""
    files = {"include/bielle/math/so3.h", "include/bielle/model/model.h", "include/bielle/results/result.h",
             "src/results/plot.h", "src/formats/yaml_entry.h", "validation/check.h",
             "src/worlds/engine.h"}
    for path, text, is_wrong in [
            ("src/model/model.cpp", '#include "bielle/math/so3.h"', False),
            ("src/math/so3.cpp", '#include "bielle/model/model.h"', True),
            ("include/bielle/math/so3.h", '#include "bielle/results/result.h"', True),
            ("src/report/page.cpp", '#include "results/plot.h"', False),
            ("src/motion/walk.cpp", '#include "results/plot.h"', True),
            ("src/formats/reader.cpp", '#include "yaml_entry.h"', False),
            ("include/bielle/report/report.h", '#include "results/plot.h"', True),
            ("examples/01_fourbar.cpp", '#include "bielle/results/result.h"', False),
            ("examples/01_fourbar.cpp", '#include "results/plot.h"', True),
            ("src/formats/reader.cpp", "#include <yaml-cpp/yaml.h>", True),
            ("src/formats/yaml_entry.cpp", "#include <yaml-cpp/yaml.h>", False),
            ("src/results/result.cpp", "#include <SimTKsimbody.h>", True),
            ("tests/test_io.cpp", "#include <SimTKsimbody.h>", True),
            ("validation/check.cpp", "#include <SimTKsimbody.h>", False),
            ("python/src/model.cpp", "#include <pybind11/pybind11.h>", False),
            ("python/src/model.cpp", '#include "results/plot.h"', True),
            ("src/results/plot.h", "#include <pybind11/pybind11.h>", True),
            ("src/worlds/terrain.cpp", '#include "worlds/engine.h"', False),
            ("src/worlds/terrain.cpp", '#include "bielle/results/result.h"', False),
            ("src/results/result.cpp", '#include "worlds/engine.h"', True),
            ("validation/check.cpp", '#include "worlds/engine.h"', False),
            ("src/results/result.cpp", '#include "validation/check.h"', True),
            ("src/results/result.cpp", '#include "check.h"', True),
            ("src/hall/result.cpp", '#include "results/plot.h"', True),
            ("workers/main.cpp", "#include <cctools/work_queue.h>", False),
            ("src/tasks/worker_tasks.cpp", "#include <cctools/work_queue.h>", True),
            ("src/worlds/CMakeLists.txt", "find_library(WORK_QUEUE work_queue)", True),
            ("src/results/CMakeLists.txt", "find_package(Simbody)", True)]:
        assert bool(check_file(path, text, files)) == is_wrong, (path, text)
    assert check_document("docs/speed.md", "see `math/so4.h`", files)
    assert not check_document("docs/speed.md", "see `math/so3.h`, `src/results/plot.h` and `name.h`", files)


def main(source):
    check_planted()
    files = set()
    for folder in FOLDERS:
        for place, _, names in os.walk(os.path.join(source, folder)):
            files |= {os.path.relpath(os.path.join(place, name), source) for name in names}
    count, problems = 0, []
    for path in sorted(files):
        if path.endswith((".h", ".cpp", "CMakeLists.txt")):
            with open(os.path.join(source, path), encoding="utf-8") as file:
                problems += check_file(path, file.read(), files)
            count += 1
    for folder in (".", "docs", "examples", "robots", "validation"):
        for place, folders, names in os.walk(os.path.join(source, folder)):
            if folder == ".":
                folders.clear()
            for name in names:
                path = os.path.relpath(os.path.join(place, name), source)
                if name.endswith(".md"):
                    with open(os.path.join(source, path), encoding="utf-8") as file:
                        problems += check_document(path, file.read(), files)
    assert count > 200, f"only {count} files in {source}"
    print("\n".join(problems) or f"{count} files, all includes in order")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
