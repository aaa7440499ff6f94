#include "robot_directory.h"

#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace fs = std::filesystem;

namespace bielle::testing {

const char* const kToyUrdf = R"(<?xml version="1.0"?>
<robot name="toy">
  <link name="base">
    <inertial>
      <mass value="3"/>
      <inertia ixx="0.03" ixy="0" ixz="0" iyy="0.03" iyz="0" izz="0.03"/>
    </inertial>
  </link>
  <link name="arm">
    <inertial>
      <origin xyz="0.1 0 0" rpy="0 0 1.5707963267948966"/>
      <mass value="1.5"/>
      <inertia ixx="0.01" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.025"/>
    </inertial>
    <visual>
      <origin xyz="0.1 0 0"/>
      <geometry><box size="0.2 0.02 0.02"/></geometry>
      <material name="red"><color rgba="1 0 0 1"/></material>
    </visual>
  </link>
  <link name="hand"/>
  <link name="rod"/>
  <joint name="shoulder" type="revolute">
    <origin xyz="0 0 0.5" rpy="0 0 0"/>
    <parent link="base"/>
    <child link="arm"/>
    <axis xyz="0 1 0"/>
    <limit lower="-1" upper="2" effort="5" velocity="7"/>
  </joint>
  <joint name="wrist" type="fixed">
    <origin xyz="0.2 0 0"/>
    <parent link="arm"/>
    <child link="hand"/>
  </joint>
  <joint name="rod_joint" type="continuous">
    <parent link="base"/>
    <child link="rod"/>
    <axis xyz="0 0 1"/>
  </joint>
</robot>
)";

const char* const kToyYaml = R"(closed_loop: [[hand, rod]]
type: [6D]
name_mot: [shoulder]
)";

std::string replaceOnce(const std::string& text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  if (at == std::string::npos || text.find(from, at + 1) != std::string::npos)
    throw std::logic_error("not exactly one '" + from + "'");
  return text.substr(0, at) + to + text.substr(at + from.size());
}

std::string readFile(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

int countLines(const std::filesystem::path& path) {
  const std::string text = readFile(path);
  return static_cast<int>(std::count(text.begin(), text.end(), '\n'));
}

RobotDirectory::RobotDirectory() {
  std::string name = (fs::temp_directory_path() / "bielle_XXXXXX").string();
  if (!mkdtemp(name.data())) throw std::runtime_error("cannot make a temporary directory");
  path_ = name;
}

RobotDirectory::~RobotDirectory() {
  std::error_code error;
  fs::remove_all(path_, error);
}

std::string RobotDirectory::write(const std::string& name, const std::string& text) const {
  const fs::path file = path_ / name;
  fs::create_directories(file.parent_path());
  fs::remove(file);  // some file systems flush a file that is truncated and written anew
  std::ofstream(file, std::ios::binary) << text;
  return file.string();
}

std::string RobotDirectory::writeRobot(const std::string& urdf, const std::string& yaml) const {
  write("robot.urdf", urdf);
  if (!yaml.empty()) write("robot.yaml", yaml);
  return path();
}

}  // namespace bielle::testing
