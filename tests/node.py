"""Packages of npm, which tests look for in $BIELLE_NODE_MODULES."""
import json
import os
import shutil
import subprocess
import sys

MODULES = os.path.abspath(os.environ.get("BIELLE_NODE_MODULES", ""))
STEP = """
import fs from 'fs';
const M = await (await import(process.argv[2] + '/@mujoco/mujoco/mujoco.js')).default();
const EQUALITY = 0;
const results = JSON.parse(fs.readFileSync(process.argv[3])).map(%s);
console.log(JSON.stringify({version: M.mj_versionString(), results}));
"""


def require(package):
    """Without it, or without node, the test ends here as a skipped one."""
    if not shutil.which("node") or not os.path.isdir(os.path.join(MODULES, package)):
        print(f"skipped: no node, or no {package} in $BIELLE_NODE_MODULES (npm install {package})")
        sys.exit(77)


def run(*arguments):
    result = subprocess.run(list(map(str, arguments)), capture_output=True, text=True)
    assert result.returncode == 0, (arguments, result.stdout + result.stderr)
    return result.stdout


def step_mujoco(function, tasks):
    """What a function of JavaScript answers to each task in today's MuJoCo, M: {"version", "results"}. Writes files here."""
    for name, text in (("program.mjs", STEP % function.strip()), ("tasks.json", json.dumps(tasks))):
        with open(name, "w", encoding="utf-8") as file:
            file.write(text)
    return json.loads(run("node", "program.mjs", MODULES, "tasks.json"))
