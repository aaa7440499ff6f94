"""The tests of a build by tier (tests/tiers.cmake)."""
import json
import subprocess


def list_tests(ctest, build):
    """[{"name": ..., "command": [...], "labels": [...]}, ...]"""
    run = subprocess.run([ctest, "--test-dir", build, "--show-only=json-v1"], capture_output=True, text=True, check=True)
    tests = []
    for test in json.loads(run.stdout)["tests"]:
        labels = [entry["value"] for entry in test.get("properties", []) if entry["name"] == "LABELS"]
        tests.append({"name": test["name"], "command": test.get("command", []), "labels": labels[0] if labels else []})
    return tests


def list_tiers(tests):
    """The names of the first tier, and of what the second one adds."""
    return ([test["name"] for test in tests if "long" not in test["labels"]],
            [test["name"] for test in tests if "long" in test["labels"]])
