#pragma once
/// \file What a program was linked without.
///
/// The command `bielle` holds what a squat needs. Readers of other formats, generators of robots, all other motions and the full
/// formulation are in libraries of their own, whose objects enter themselves in tables when a program that has them starts. Whoever
/// looks for an entry that is not there throws a MissingPart; the command then becomes its complete program (cli/program.h).
/// Programs that link bielle::bielle have everything and never see it.
#include <stdexcept>
#include <string>

namespace bielle {

/// Not an InputError: nothing is wrong with the input, and nobody may answer it but the program itself.
struct MissingPart : std::runtime_error {
  /// \param part  e.g. "the reader of .xml files"
  explicit MissingPart(const std::string& part)
      : std::runtime_error("this program was linked without " + part + "; link bielle::bielle") {}
};

}  // namespace bielle
