// What is wrong with a file that names a generator.
#include <catch2/catch.hpp>

#include "bielle/robots/robot_loader.h"
#include "robot_directory.h"

using namespace bielle;
using namespace bielle::testing;

TEST_CASE("files that name a generator: errors give the file, the line, the parameter and what to do") {
  const RobotDirectory files;
  const auto refuse = [&](const std::string& text, const std::string& place, const std::string& problem) {
    CAPTURE(text);
    const std::string file = files.write("bad/bad.yaml", text);
    CHECK_THROWS_WITH(loadRobot(file),
                      Catch::StartsWith(file + ": ") && Catch::Contains(place) && Catch::Contains(problem));
  };
  refuse("generator: no_such\n", "key 'generator' (line 1)", "no such generator as 'no_such'; choose one of: cleobot");
  refuse("generator: [leg_biped]\n", "key 'generator' (line 1)", "not a name");
  refuse("generator: leg_biped\nset:\n  nee: belt\n", "key 'set': key 'nee' (line 3)",
         "no such parameter; the nearest is 'knee'");
  refuse("generator: leg_biped\nset: {knee: chain}\n", "key 'knee' (line 2)",
         "not one of its choices; give one of ball_screw, belt, drawn");
  refuse("generator: leg_biped\nset: {thigh_length: long}\n", "key 'thigh_length' (line 2)", "not a number");
  refuse("generator: leg_biped\nset: {thigh_length: 50}\n", "key 'thigh_length' (line 2)", "50 m is outside 0.05 .. 1");
  refuse("generator: leg_biped\nset: {thigh_length: .nan}\n", "key 'thigh_length' (line 2)", "not a number");
  refuse("generator: leg_biped\nset: [knee]\n", "key 'set' (line 2)", "not a map");
  refuse("generator: rsu_biped\nset: {hip_height: 0.8}\n", "key 'generator' (line 1)", "do not reach the ground");
  const std::string part = files.write("bad/knee.yaml",
                                       "mounts: {base: link, output: link, joint: joint}\n"
                                       "parameters:\n  motor_mass: {unit: kg}\n"
                                       "tree: {}\n"
                                       "solids:\n  base: [{motor: motor_mas, at: origin, axis: y}]\n");
  refuse("generator: leg_biped\nset: {knee: knee.yaml}\n", "key 'generator' (line 1): " + part + ": key 'solids'",
         "(line 6): 'motor_mas' is unknown");
  refuse("set: {knee: belt}\n", "key 'set' (line 1)", "there is no generator");
  refuse("generator: rsu_biped\nmodel: bipetto\n", "key 'generator' (line 1)", "keep one of them");
  refuse("generator: rsu_biped\nparts: 1\n", "key 'parts' (line 2)", "known keys are");
  refuse("base: free\n", "key 'model'", "as is `generator`");
  files.write("bad/bad.yaml", "generator: rsu_biped\n");
  files.write("bad/bad.urdf", kToyUrdf);
  CHECK_THROWS_WITH(loadRobot(files.path() + "/bad"),
                    Catch::Contains("key 'generator'") && Catch::Contains("URDF beside"));
}
