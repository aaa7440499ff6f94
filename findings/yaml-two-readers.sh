#!/bin/bash
# One YAML file of a robot, two mechanisms: yaml-cpp 0.7.0 against PyYAML 6.0, and yaml-cpp against itself.
#
# Seen on Debian 12 (libyaml-cpp 0.7.0+dfsg-8+b1, python3-yaml 6.0-3+b2), on a file that is valid by both readers:
# - a key that stands twice in a map (YAML forbids it) is an error for neither: yaml-cpp takes the first value, PyYAML the last;
# - the scalar 010 is 8 for yaml-cpp where the program asks for an int, and 10 where it asks for a double; 08 is 8.0 as a double
#   and an error as an int. PyYAML reads 010 as 8, and 08 as a text;
# - 1e3 is 1000 for yaml-cpp, and a text for PyYAML (which wants 1.0e+3);
# - a merge key (<<) gives its entries to PyYAML's reader only.
# A robot that was checked by a Python tool is another one in a C++ program. Exit status 0: as described; 1: it has changed.
set -euo pipefail
yaml_cpp=0.7.0+dfsg-8+b1 pyyaml=6.0-3+b2
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
apt-get download -qq "libyaml-cpp-dev=$yaml_cpp" "libyaml-cpp0.7=$yaml_cpp" "python3-yaml=$pyyaml"
for package in *.deb; do dpkg -x "$package" root; done
libraries=$(dirname "$(find root -name libyaml-cpp.so.0.7)")

cat > spring.yaml <<'YAML'
defaults: &defaults {damping: 0.1}
spring:
  <<: *defaults
  stiffness: 250
  stiffness: 400
  teeth: 010
  offset: 08
  limit: 1e3
YAML

cat > read.cpp <<'CPP'
#include <yaml-cpp/yaml.h>

#include <iostream>
int main() {
  const YAML::Node spring = YAML::LoadFile("spring.yaml")["spring"];
  std::cout << "stiffness " << spring["stiffness"].as<double>() << "\n";
  std::cout << "teeth " << spring["teeth"].as<int>() << " " << spring["teeth"].as<double>() << "\n";
  std::cout << "offset " << spring["offset"].as<double>() << " ";
  try {
    std::cout << spring["offset"].as<int>() << "\n";
  } catch (const YAML::Exception&) {
    std::cout << "error\n";
  }
  std::cout << "limit " << spring["limit"].as<double>() << "\n";
  std::cout << "damping " << (spring["damping"] ? "given" : "missing") << "\n";
}
CPP
g++ -std=c++17 read.cpp -I root/usr/include -L "$libraries" -Wl,-rpath,"$PWD/$libraries" -l:libyaml-cpp.so.0.7 -o read
./read > seen
cat > read.py <<'PYTHON'
import yaml
spring = yaml.safe_load(open("spring.yaml"))["spring"]
for key in ("stiffness", "teeth", "offset", "limit", "damping"):
    print(key, repr(spring[key]))
PYTHON
PYTHONPATH=root/usr/lib/python3/dist-packages /usr/bin/python3 read.py >> seen

cat > expected <<'TEXT'
stiffness 250
teeth 8 10
offset 8 error
limit 1000
damping missing
stiffness 400
teeth 8
offset '08'
limit '1e3'
damping 0.1
TEXT
cat seen
diff expected seen && echo "as described"
