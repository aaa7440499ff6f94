#pragma once
/// \file What a command prints, when nobody takes it: a full disk, a pipe whose reader has gone.
namespace bielle {

/// From now on a reader that goes away (`| head`) does not end the program, which may have results to write.
void ignoreClosedPipes();

/// To be called at the end. \throws ModelError when the standard output was not taken whole
void finishStandardOutput();

}  // namespace bielle
