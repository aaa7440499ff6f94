// Malicious trajectories: sizes that overflow or lie, archives that unpack to more than the memory, headers that crash
// a recursive parser. Each is rejected with one error that names the file. The archives are made by Python's zipfile.
// Also: devices and pipes are written to and not replaced.
#include <sys/stat.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "bielle/model/error.h"
#include "bielle/results/result.h"
#include "formats/text_file.h"
#include "get_error_of_reading.h"
#include "robot_directory.h"

namespace fs = std::filesystem;
using namespace bielle;
using namespace bielle::testing;

namespace {

// Arguments: where to write. Each archive is a whole trajectory of one joint but for one array, which is replaced.
const char* const kMakeArchives = R"(
import struct, sys, zipfile

def array(kind, shape, data, length=None):
    header = "{'descr': '%s', 'fortran_order': False, 'shape': (%s), }" % (kind, "".join("%d," % n for n in shape))
    header = header.ljust(length or 117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header.encode() + data

def texts(*names):
    return array("<U4", (len(names),), b"".join(name.encode("utf-32-le").ljust(16, b"\0") for name in names))

def numbers(*shape):
    count = 1
    for n in shape:
        count *= n
    return array("<f8", shape, b"\0" * 8 * count)

good = {"q_names": texts("a"), "v_names": texts("a"), "u_names": texts("m"), "closure_names": texts(), "contact_names": texts(),
        "time": numbers(300), "q": numbers(300, 1), "v": numbers(300, 1), "a": numbers(299, 1), "u": numbers(299, 1),
        "closure_wrenches": numbers(299, 0, 6), "contact_wrenches": numbers(299, 0, 6),
        "com": numbers(300, 3), "gap": numbers(300, 2)}
bad = {
    "good": {},
    "overflow": {"q": array("<f8", (2**29, 2**29, 8), b"")},  # 2^61 numbers of 8 bytes: 2^64 is 0
    "zeros": {"q": array("<f8", (999999999,) * 7 + (0,), b"")},
    "many_names": {"q_names": array("<U0", (999999999,), b"")},
    "header": {"q": array("<f8", (300, 1), b"\0" * 2400, 65000)},
    "digits": {"q": array("<f8", (1,) * 20000, b"\0" * 8)},
    "cut": {"q": numbers(300, 1)[:-3]},
    "empty": {"q": b""},
    "nodes": {"time": numbers(0)},
    "rows": {"q": numbers(299, 1)},
    "text": {"q": texts("a", "b", "c")},
    "bomb": {"q": b"\0" * 300_000_000},
}
for name, changes in bad.items():
    with zipfile.ZipFile(sys.argv[1] + "/" + name + ".npz", "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        for entry, data in {**good, **changes}.items():
            archive.writestr(entry + ".npy", data)
lie = bytearray(open(sys.argv[1] + "/good.npz", "rb").read())
at = 0
while True:  # every size in the central directory says 4 GB
    at = lie.find(b"PK\x01\x02", at)
    if at < 0:
        break
    lie[at + 24:at + 28] = b"\xfe\xff\xff\xff"
    at += 4
open(sys.argv[1] + "/lie.npz", "wb").write(lie)
)";

}  // namespace

TEST_CASE("archives that lie about themselves are refused") {
  const RobotDirectory directory;
  const std::string script = directory.write("make.py", kMakeArchives);
  REQUIRE(std::system((std::string(BIELLE_PYTHON) + " " + script + " " + directory.path()).c_str()) == 0);
  CHECK(getErrorOfReading(directory.path() + "/good.npz").empty());
  CHECK(readRecord(directory.path() + "/good.npz").q.rows() == 300);
  int refused = 0;
  for (const auto& entry : fs::directory_iterator(directory.path())) {
    if (entry.path().extension() != ".npz" || entry.path().stem() == "good") continue;
    const std::string error = getErrorOfReading(entry.path().string());
    CAPTURE(entry.path().filename().string());
    CHECK(error.rfind(entry.path().string() + ": ", 0) == 0);
    ++refused;
  }
  CHECK(refused == 12);
}

TEST_CASE("errors are one printable line, whatever the names in the files") {
  const InputError error("file", std::string("joint 'a\nb\0c\x1b[2J'", 17), std::string(100000, 'x'), "rename it");
  const std::string text = error.what();
  CHECK(text.rfind("file: joint 'a b\\x00c\\x1b[2J': xxx", 0) == 0);
  CHECK(text.size() < 2000);
  CHECK(text.substr(text.size() - 11) == "; rename it");
}

TEST_CASE("a pipe is written to, a file is replaced, a directory is refused") {
  const RobotDirectory directory;
  const std::string file = directory.write("file", "before"), pipe = directory.path() + "/pipe";
  writeTextFile(file, "after");
  std::string text;
  std::ifstream(file) >> text;
  CHECK(text == "after");
  REQUIRE(mkfifo(pipe.c_str(), 0600) == 0);
  const std::string copy = directory.path() + "/copy";
  REQUIRE(std::system(("cat " + pipe + " > " + copy + " &").c_str()) == 0);
  writeTextFile(pipe, "through");
  CHECK(fs::is_fifo(pipe));
  for (int i = 0; i < 500 && text != "through"; ++i) {
    std::system("sleep 0.01");
    std::ifstream(copy) >> text;
  }
  CHECK(text == "through");
  CHECK_THROWS_WITH(writeTextFile("/dev/full", std::string(100000, 'x')),
                    Catch::Contains("/dev/full: file: it cannot be written"));
  CHECK(fs::is_character_file("/dev/full"));
  CHECK_THROWS_AS(writeTextFile(directory.path(), "x"), InputError);
  CHECK_THROWS_AS(writeTextFile(directory.path() + "/none/file", "x"), InputError);
  int left = 0;
  for (const auto& entry : fs::directory_iterator(directory.path()))
    left += entry.path().string().find(".part") != std::string::npos;
  CHECK(left == 0);
}

TEST_CASE("files: what a process that was killed has left of a file goes when the file is written") {
  const RobotDirectory directory;
  const std::string file = directory.path() + "/file", nobody = ".part99999999";  // more than there can be processes
  const std::string living = ".part" + std::to_string(getppid());
  for (const std::string& name : {"file" + nobody, "file" + living, std::string("file.part"), "file" + nobody + "x",
                                  std::string("file.part0"), "other" + nobody})
    directory.write(name, "x");
  writeTextFile(file, "whole");
  CHECK_FALSE(fs::exists(file + nobody));
  for (const std::string& name :
       {"file" + living, std::string("file.part"), "file" + nobody + "x", std::string("file.part0"), "other" + nobody})
    CHECK(fs::exists(directory.path() + "/" + name));
}
