#!/usr/bin/env python3
"""Writes docs/results/design.md and docs/images/design_front.svg: the front of docs/design.md, by two searches.

    docs/results/design.py [--bielle build/bin/bielle] [--quick]

Reads the specification two.yaml from docs/design.md. The longer search takes a few minutes of processor time.
"""
import json
import pathlib
import re
import shutil

import common

LONGER = [("depth: 0.7, time_step: 0.04", "depth: 0.7, time_step: 0.02"),
          ("speed: 0.5, time_step: 0.03", "speed: 0.5, time_step: 0.02"),
          ("population: 8, generations: 1", "population: 32, generations: 3")]
KNEES = ("four_bar", "belt", "serial")  # choices in the order of the specification


def read_specification():
    guide = (common.SOURCE / "docs/design.md").read_text(encoding="utf-8")
    return re.search(r"cat > two.yaml <<'END'\n(.*?)END\n", guide, re.DOTALL)[1]


def search(runner, text):
    """The directory of the results of a specification."""
    directory = pathlib.Path(runner.place())
    specification = directory.with_suffix(".yaml")
    specification.write_text(text, encoding="utf-8")
    runner.run("design", specification, "-o", directory)
    return directory


def read_front(directory):
    """[(robot, knee, motor, energy, mass), ...]"""
    lines = (directory / "design.md").read_text(encoding="utf-8").splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("| robot |"))
    columns = [cell.strip() for cell in lines[start].strip("|").split("|")]
    rows = []
    for line in lines[start + 2:]:
        if not line.startswith("|"):
            break
        row = dict(zip(columns, (cell.strip() for cell in line.strip("|").split("|"))))
        energy = next(value for name, value in row.items() if name.startswith("electrical_energy"))
        mass = next(value for name, value in row.items() if name.startswith("mass"))
        rows.append((row["robot"], row["knee"], row["motor"], energy, mass))
    return rows


def count_designs(directory):
    """{knee: [feasible, all]}"""
    counts = {knee: [0, 0] for knee in KNEES}
    lines = (directory / "front.jsonl").read_text(encoding="utf-8").splitlines()
    for line in lines[1:]:
        design = json.loads(line)
        knee = counts[KNEES[round(design["x"][0])]]
        knee[0] += design["status"] == "feasible"
        knee[1] += 1
    return counts


def add_search(page, title, directory):
    counts = count_designs(directory)
    designs = sum(total for _, total in counts.values())
    shares = ", ".join(f"{feasible} of {total} with {knee} knees" for knee, (feasible, total) in counts.items())
    page.heading(title)
    page.add(f"{designs} designs; feasible: {shares}.")
    page.table(["robot", "knee", "motor", "energy of the knees [J]", "mass [kg]"],
               [list(row) for row in read_front(directory)])


def main():
    arguments = common.make_parser(__doc__).parse_args()
    runner = common.Runner(arguments.bielle)
    page = common.Page(__file__, "A front of two sizes", common.describe_run(arguments.commit))
    page.add("""The specification `two.yaml` of the [guide](../design.md), as it is there and with more designs and finer
stages.""")
    text = read_specification()
    add_search(page, "Short", search(runner, text))
    if not arguments.quick:
        for old, new in LONGER:
            assert old in text, old
            text = text.replace(old, new)
        directory = search(runner, text)
        add_search(page, "Longer", directory)
        page.add("![the front of the longer search, among all feasible designs](../images/design_front.svg)")
        shutil.copy(directory / "design_front.svg", common.SOURCE / "docs/images/design_front.svg")
        page.add("""Energies of the two searches differ by a few per cent, because their stages do. Dimensions and gears at a bound
mean "as much as allowed". Parts that are rarely feasible, such as four-bars here, get few offspring in a mixed population: search
them alone before you judge them.""")
    page.write(arguments.quick)


if __name__ == "__main__":
    main()
