#pragma once
/// \file Programs beside this one: `bielle` is a small core, and everything else is a program of its own (cli/program.h). In a build
/// tree they are built when they are first needed; an installation brings them all.
#include <string>

namespace bielle {

/// The path of a program beside this one, or else the bare name, which is searched on the PATH.
std::string findCompanion(const std::string& program);

/// A companion that can be started. Where this program was built and the other one was not, it is built: lines on the standard
/// error tell what, how far it is and how long it took. Two calls at once build once, and a build that was cut off goes on with the
/// next call. Empty if it is not to be had.
std::string obtainCompanion(const std::string& program);

/// The same. \throws InputError with describeMissingCompanion() if it is not to be had
std::string requireCompanion(const std::string& program);

/// What is wrong, and how it is to be had: "bielle-design is neither beside this program nor on the PATH; ...".
std::string describeMissingCompanion(const std::string& program);

}  // namespace bielle
