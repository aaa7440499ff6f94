#!/bin/bash
# In muParser, 0.5 and 0.5 is false where both are numbers, and true where one is a variable of this value: while it simplifies an
# expression, it cuts the operands of && and || to whole numbers.
#
# Seen with muParser 2.3.3 (Debian 12, libmuparser2v5 2.3.3-0.1), simplifying as it does by default, for x = 0.5:
# - `0.5 && 0.5` and `0.5 || 0` are 0; `x && 0.5` and `x || 0` are 1;
# - a number that is not 0 counts as true elsewhere: `0.5 ? 1 : 0` is 1, `0.5 && x` too;
# - with EnableOptimizer(false) all are 1.
# A condition on given lengths, in metres, fails once they are numbers. Exit status 0: as described; 1: it has changed.
set -euo pipefail
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
cd "$work"
apt-get download -qq libmuparser-dev=2.3.3-0.1 libmuparser2v5=2.3.3-0.1
for package in *.deb; do dpkg -x "$package" root; done
cat > evaluate.cpp <<'CPP'
#include <muParser.h>

#include <cstdio>
int main() {
  double x = 0.5;
  for (const char* text : {"0.5 && 0.5", "x && 0.5", "0.5 && x", "0.5 || 0", "x || 0", "0.5 ? 1 : 0", "1 && 2"}) {
    std::printf("%s:", text);
    for (const bool is_simplified : {true, false}) {
      mu::Parser parser;
      parser.DefineVar("x", &x);
      parser.EnableOptimizer(is_simplified);
      parser.SetExpr(text);
      std::printf(" %g", parser.Eval());
    }
    std::printf("\n");
  }
}
CPP
libraries=root/usr/lib/x86_64-linux-gnu
g++ -std=c++17 evaluate.cpp -I root/usr/include -L $libraries -Wl,-rpath,"$PWD/$libraries" -l:libmuparser.so.2 -o evaluate
./evaluate | tee seen
cat > expected <<'TEXT'
0.5 && 0.5: 0 1
x && 0.5: 1 1
0.5 && x: 1 1
0.5 || 0: 0 1
x || 0: 1 1
0.5 ? 1 : 0: 1 1
1 && 2: 1 1
TEXT
diff expected seen && echo "as described"
