#pragma once
/// \file Access to the elements of a file of MuJoCo (MJCF): attributes with the defaults of their classes, numbers, and
/// notes of all that nobody asked for.
#include <map>
#include <memory>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "bielle/math/se3.h"
#include "formats/mjcf_files.h"

namespace bielle {

struct UrdfFile;

struct MjcfAttribute {
  std::string value, path;  ///< and the file that says it
  int line = 0;
};
using MjcfAttributes = std::map<std::string, MjcfAttribute>;

/// What the reader leaves out, one warning per kind with all its lines.
class MjcfNotes {
 public:
  void add(const std::string& path, const std::string& element, int line, const std::string& problem);
  void addAttribute(const std::string& path, const std::string& element, int line, const std::string& attribute);
  /// Of what changes no mechanism, such as cameras and lights.
  void addHarmless(const std::string& path, const std::string& element, int line,
                   const std::string& problem = "left out");
  /// "path: element (lines ...): problem", in the order in which they were first added, as warnings; what is just "left out" is one
  /// line of a file at the end. What changes no mechanism, to which most attributes about contacts and solvers belong, goes apart.
  void addTo(UrdfFile& tree) const;

 private:
  struct Kind {
    std::string path, element, problem;
    bool operator<(const Kind& other) const {
      return std::tie(path, element, problem) < std::tie(other.path, other.element, other.problem);
    }
  };
  std::vector<Kind> order_;
  std::set<Kind> harmless_;
  std::map<Kind, std::set<int>> lines_;
  // Attributes and their lines, by path and element.
  std::map<std::pair<std::string, std::string>, std::pair<std::set<std::string>, std::set<int>>> attributes_;
};

/// What holds for the whole model.
struct MjcfSettings {
  explicit MjcfSettings(const std::string& main) : path(main), files(main) {}

  std::string path;  ///< of the main file
  MjcfFiles files;
  double angle = EIGEN_PI / 180;  ///< unit of angles, rad
  std::string euler = "xyz";
  bool auto_limits = true;                                                ///< as today
  std::map<std::string, std::map<std::string, MjcfAttributes>> defaults;  ///< by class and tag
  size_t num_defaults = 0;
  MjcfNotes notes;
};

/// Reads <default>, which nest.
void readMjcfDefaults(const XMLElement& element, const std::string& parent, MjcfSettings& settings);

/// An element with the defaults of its class. Attributes that were not asked for until the end are noted.
class MjcfElement {
 public:
  /// \param childclass  class of elements that name none
  MjcfElement(const XMLElement& element, const std::string& childclass, MjcfSettings& settings);
  /// \param kind  whose defaults hold for it, in place of its tag
  MjcfElement(const XMLElement& element, const std::string& childclass, MjcfSettings& settings,
              const std::string& kind);
  ~MjcfElement();
  MjcfElement(const MjcfElement&) = delete;
  MjcfElement& operator=(const MjcfElement&) = delete;

  [[noreturn]] void fail(const std::string& problem, const std::string& remedy) const;
  void note(const std::string& problem) const;
  void noteHarmless(const std::string& problem) const;  ///< of what changes no mechanism
  /// The same of an element that is not read: its attributes are not noted.
  void leaveOut(const std::string& problem = "left out");
  /// "joint 'knee' (line 3)"
  std::string describe() const;
  const std::string& tag() const { return tag_; }
  const std::string& path() const { return path_; }
  int line() const { return line_; }

  /// Null without it.
  const std::string* find(const std::string& attribute);
  std::string getText(const std::string& attribute, const std::string& otherwise = "");
  bool getFlag(const std::string& attribute, bool otherwise);
  double getNumber(const std::string& attribute, double otherwise);
  /// Empty without it; `least` to `most` finite numbers.
  std::vector<double> getNumbers(const std::string& attribute, size_t least, size_t most);
  Vector3d getVector(const std::string& attribute, const Vector3d& otherwise);
  /// By quat, axisangle, xyaxes, zaxis or euler.
  Matrix3d getRotation();
  /// pos, and getRotation().
  SE3 getPose();
  /// Whether limits hold; `limited` may be true, false or auto.
  bool isLimited(const std::string& limited, const std::string& range);

 private:
  double getAngle(double value) const { return value * settings_.angle; }

  MjcfSettings& settings_;
  std::string path_, tag_, name_;
  int line_;
  MjcfAttributes attributes_;
  std::set<std::string> asked_;
};

}  // namespace bielle
