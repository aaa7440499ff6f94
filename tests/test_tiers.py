"""test_tiers.py CTEST BUILD SOURCE: every file of tests is run by CTest, every case by one tier, and docs/results/wait.md says
which tier each test is in."""
import collections
import os
import pathlib
import re
import subprocess
import sys

from list_tiers import list_tests, list_tiers

ctest, build, source = sys.argv[1:]
source = pathlib.Path(source)
tests = list_tests(ctest, build)
assert len({test["name"] for test in tests}) == len(tests)

# Kinds are told apart: a quick test of a unit, a test of the whole, or one of the second tier.
for test in tests:
    kinds = {"unit", "system", "long"} & set(test["labels"])
    assert len(kinds) == 1, f"{test['name']}: it is labelled {test['labels']}"
    assert "memory" not in test["labels"] or kinds == {"unit"}, f"{test['name']}: sanitizers run units of the first tier"

# No file is forgotten. Those for packages that are not installed here are left out of the build by name.
places = [path for pattern in ("tests/*.cmake", "tests/CMakeLists.txt", "validation/**/CMakeLists.txt")
          for path in source.glob(pattern)]
named = set(re.findall(r"[\w${}]+", " ".join(path.read_text(encoding="utf-8") for path in places)))
commands = {os.path.basename(word) for test in tests for word in test["command"]}
for pattern in ("tests/test_*.cpp", "tests/test_*.py", "validation/**/test_*.cpp", "python/tests/test_*.py"):
    for path in source.glob(pattern):
        name = path.stem.removeprefix("test_")
        assert path.stem in named or path.name in commands or name in named, f"{path}: no test of CTest runs it"

# Every case that is not hidden runs in one tier, or, if it tries a share of its mechanisms in the first, in both.
cases = collections.defaultdict(lambda: collections.defaultdict(list))  # {program: {case: [tier, ...]}}
for test in tests:
    program, *arguments = test["command"] or [""]
    if "--filenames-as-tags" not in arguments or not os.path.exists(program):  # the first tier does not build all
        continue
    tier = "long" if "long" in test["labels"] else "short"
    run = subprocess.run([program, *arguments, "--list-test-names-only"], capture_output=True, text=True)
    names = run.stdout.splitlines()
    assert names, f"{test['name']}: it has no case"
    for name in names:
        cases[program][name].append(tier)
assert cases
for program, tiers in cases.items():
    def list_names(*spec):
        return set(subprocess.run([program, *spec, "--list-test-names-only"], capture_output=True,
                                  text=True).stdout.splitlines())
    for name in list_names("~[.]"):
        assert tiers[name], f"{program}: no test of CTest runs '{name}'"
    shared = list_names("[sweep]")
    for name, found in tiers.items():
        assert sorted(found) == (["long", "short"] if name in shared else found[:1]), f"{program}: '{name}' runs in {found}"

# The page. Where packages are missing it names more.
page = (source / "docs" / "results" / "wait.md").read_text(encoding="utf-8")
parts = [set(re.findall(r"\S+", re.sub(r"[`,]", " ", part))) for part in page.split("\n## ")[1:]]
assert len(parts) == 2, "docs/results/wait.md lists no tiers"
for names, part in zip(list_tiers(tests), parts):
    missing = [name for name in names if name not in part]
    assert not missing, f"docs/results/wait.md does not name {', '.join(missing)} (docs/results/wait.py --measure)"
print(f"{len(tests)} tests, {sum(map(len, cases.values()))} cases")
