// Parts of leg_biped, each in one of eight robots: dynamics against Simbody, a squat and a walk that pass the check.
#include <catch2/catch.hpp>

#include "robot_directory.h"
#include "run_command.h"

using namespace bielle::testing;
using Catch::Contains;

TEST_CASE("parts: bipeds of them squat and walk, and have Simbody's dynamics") {
  const RobotDirectory files;
  const char* const robots[] = {
      "hip: serial, knee: watt, ankle: biarticular",
      "hip: serial, knee: stephenson, ankle: spu",
      "hip: parallel_spring, hip_drive: three_rrs, knee: parallel_spring, knee_drive: four_bar, ankle: digit",
      "hip: serial, knee: pantograph, ankle: thigh_rods",
      "hip: serial, knee: ball_screw, ankle: stacked_rods",
      "hip: serial, knee: drawn, ankle: serial",
      "hip: serial, knee: leaf, ankle: serial",
      "hip: serial, knee: passive, ankle: cable_differential"};
  int count = 0;
  for (const char* parts : robots) {
    CAPTURE(parts);
    const std::string name = "biped" + std::to_string(++count);
    const std::string robot =
        files.write(name + "/" + name + ".yaml", "generator: leg_biped\nset: {" + std::string(parts) + "}\n");
    // Without rotors, the light lever of the leaf swings too fast for the steps in which motions are compared.
    const bool is_stiff = std::string(parts).find("leaf") != std::string::npos;
    const CommandResult validated = runCommand({BIELLE_COMMAND, "validate", "--samples", "2", "--motion",
                                                is_stiff ? "0" : "0.02", "--motion-step", "1e-4", robot});
    INFO(validated.out << validated.err);
    CHECK(validated.status == 0);
    const std::pair<const char*, std::vector<std::string>> motions[] = {
        {"squat", {"--set", "duration=1", "--set", "settle=0.2"}}, {"walk", {"--steps", "2"}}};
    for (const auto& [motion, settings] : motions) {
      std::vector<std::string> arguments = {BIELLE_COMMAND, "solve",       motion, "--robot",
                                            robot,          "--no-report", "-o",   files.path() + "/" + name + motion};
      arguments.insert(arguments.end(), settings.begin(), settings.end());
      const CommandResult solved = runCommand(arguments);
      INFO(solved.out << solved.err);
      CHECK(solved.status == 0);
      CHECK_THAT(solved.out, Contains(": passed"));
    }
  }
}
