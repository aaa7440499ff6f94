#pragma once
/// \file Failures of the standard output: a full disk, a pipe whose reader has ended.
namespace bielle {

/// Prevents a reader that ends early (`| head`) from terminating the program, which may still have results to write.
void ignoreClosedPipes();

/// Call this at the end. A reader that has seen enough is no failure.
/// \throws InputError when the standard output could not be written completely, as on a full disk
void finishStandardOutput();

}  // namespace bielle
